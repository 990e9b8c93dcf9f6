#include "tools/studies/score/fit_answers.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "core/units.hpp"
#include "tools/studies/score/parallel_items.hpp"
#include "tools/studies/score/trials.hpp"

namespace merkel {
namespace {

constexpr double kHzPerFraction = 100.0;

double unit_of(const FitTrace& trace) { return trace.decline ? kHzPerFraction : 1.0; }

}  // namespace

Expected<std::vector<FitTrace>, ParameterError> fit_traces(const TactileModel::Parameters& scene,
                                                           const std::vector<DataSet>& sets,
                                                           std::size_t threads) {
  std::vector<FitTrace> traces;
  for (const DataSet& set : sets) {
    const double weight =
        1.0 / static_cast<double>(set.points.size()) / static_cast<double>(sets.size());
    for (const DataSet::Point& point : set.points) {
      traces.push_back({.point = &point, .decline = set.y_name == "decline", .weight = weight});
    }
  }
  std::vector<std::optional<Trials>> models(std::max<std::size_t>(1, threads));
  const auto trace = [&](std::size_t worker, std::size_t i) -> std::optional<ParameterError> {
    const Stimulus& stimulus = traces[i].point->stimulus;
    std::optional<Trials>& model = models[worker];
    if (!model || !model->fits(stimulus)) {
      auto made = Trials::create(scene, stimulus, 1);
      if (!made) return made.error();
      model.emplace(std::move(*made));
    }
    traces[i].energy_kPa = model->energies_kPa(stimulus);
    traces[i].tick = model->tick();
    traces[i].step = model->step();
    return std::nullopt;
  };
  if (const auto error = try_each_item(traces.size(), threads, trace)) {
    return Unexpected<ParameterError>(*error);
  }
  return traces;
}

Eigen::VectorXd FitAnswers::of(const TactileModel::Parameters& parameters) {
  if (parameters.patches.front().field.radius_mm != scene_.patches.front().field.radius_mm) {
    scene_ = parameters;
    traces_ = *fit_traces(scene_, sets_, threads_);
  }
  Eigen::VectorXd answers(static_cast<Eigen::Index>(traces_.size()));
  TactileModel::Parameters own = parameters;
  for (const FitTrace& trace : traces_) {
    own.step = trace.step;
    if (!tables_.contains(own.step)) tables_.emplace(own.step, afferent_tables_of(own));
  }
  for_each_item(traces_.size(), threads_, [&](std::size_t /*worker*/, std::size_t i) {
    answers[static_cast<Eigen::Index>(i)] = answer(parameters, traces_[i]);
  });
  return answers;
}

Eigen::VectorXd FitAnswers::measured() const {
  Eigen::VectorXd values(static_cast<Eigen::Index>(traces_.size()));
  for (std::size_t i = 0; i < traces_.size(); ++i) {
    values[static_cast<Eigen::Index>(i)] = traces_[i].point->measured * unit_of(traces_[i]);
  }
  return values;
}

Eigen::VectorXd FitAnswers::weights() const {
  Eigen::VectorXd values(static_cast<Eigen::Index>(traces_.size()));
  for (std::size_t i = 0; i < traces_.size(); ++i) {
    values[static_cast<Eigen::Index>(i)] = traces_[i].weight;
  }
  return values;
}

double FitAnswers::answer(const TactileModel::Parameters& parameters, const FitTrace& trace) const {
  TactileModel::Parameters own = parameters;
  own.step = trace.step;
  Afferents neurons = *Afferents::create(own, 0, trials_, tables_.at(own.step));
  std::vector<std::vector<double>> times(trials_);
  SpikeBuffer spikes(trials_ * 4);
  std::vector<double> before(trials_, 0.0);
  std::vector<double> after(trials_, 0.0);
  const int steps = static_cast<int>(trace.tick / trace.step);
  std::chrono::nanoseconds time{0};
  for (const double energy : trace.energy_kPa) {
    before.swap(after);
    std::fill(after.begin(), after.end(), energy);
    spikes.clear();
    neurons.advance(before, after, steps, time, spikes, nullptr);
    for (const SpikeEvent& spike : spikes.events()) {
      times[spike.neuron - 1].push_back(units::s_from(spike.time));
    }
    time += trace.tick;
  }
  return answer_of(trace.point->stimulus, times).value * unit_of(trace);
}

}  // namespace merkel
