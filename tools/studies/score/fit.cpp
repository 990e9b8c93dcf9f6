#include "tools/studies/score/fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include <Eigen/Dense>
#include <nlopt.h>

#include "core/parameters/nearest_name.hpp"
#include "core/scene/afferents.hpp"
#include "core/scene/model_fields.hpp"
#include "core/units.hpp"
#include "tools/studies/score/trials.hpp"

namespace merkel {
namespace {

constexpr double kWidest = 20.0;
constexpr double kHzPerFraction = 100.0;

/// A stimulus as the neurons get it.
struct Trace {
  const DataSet::Point* point = nullptr;
  bool decline = false;
  double weight = 0.0;  ///< of its squared error in the cost
  std::vector<double> energy_kPa;
  std::chrono::nanoseconds tick{0};
  std::chrono::nanoseconds step{0};
};

Expected<std::vector<Trace>, ParameterError> traces_of(const TactileModel::Parameters& scene,
                                                       const std::vector<DataSet>& sets) {
  std::vector<Trace> traces;
  std::optional<Trials> model;
  for (const DataSet& set : sets) {
    const double weight =
        1.0 / static_cast<double>(set.points.size()) / static_cast<double>(sets.size());
    for (const DataSet::Point& point : set.points) {
      if (!model || !model->fits(point.stimulus)) {
        auto made = Trials::create(scene, point.stimulus, 1);
        if (!made) return Unexpected<ParameterError>(made.error());
        model.emplace(std::move(*made));
      }
      traces.push_back({.point = &point,
                        .decline = set.y_name == "decline",
                        .weight = weight,
                        .energy_kPa = model->energies_kPa(point.stimulus),
                        .tick = model->tick(),
                        .step = model->step()});
    }
  }
  return traces;
}

/// The model's answers, in Hz; a decline in percent.
class Answers {
 public:
  Answers(const std::vector<Trace>& traces, std::size_t trials)
      : traces_(traces), trials_(trials) {}

  Eigen::VectorXd of(const TactileModel::Parameters& parameters) {
    Eigen::VectorXd answers(static_cast<Eigen::Index>(traces_.size()));
    for (std::size_t i = 0; i < traces_.size(); ++i) {
      answers[static_cast<Eigen::Index>(i)] = answer(parameters, traces_[i]);
    }
    ++evaluations_;
    return answers;
  }
  [[nodiscard]] Eigen::VectorXd measured() const {
    Eigen::VectorXd values(static_cast<Eigen::Index>(traces_.size()));
    for (std::size_t i = 0; i < traces_.size(); ++i) {
      values[static_cast<Eigen::Index>(i)] =
          traces_[i].point->measured * (traces_[i].decline ? kHzPerFraction : 1.0);
    }
    return values;
  }
  [[nodiscard]] Eigen::VectorXd weights() const {
    Eigen::VectorXd values(static_cast<Eigen::Index>(traces_.size()));
    for (std::size_t i = 0; i < traces_.size(); ++i) {
      values[static_cast<Eigen::Index>(i)] = traces_[i].weight;
    }
    return values;
  }
  [[nodiscard]] int evaluations() const { return evaluations_; }

 private:
  double answer(const TactileModel::Parameters& parameters, const Trace& trace) {
    TactileModel::Parameters own = parameters;
    own.step = trace.step;
    if (table_step_ != own.step) {
      table_ = *rate_current_table_of(own);
      table_step_ = own.step;
    }
    Afferents neurons = *Afferents::create(own, 0, trials_, table_);
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
    return answer_of(trace.point->stimulus, times).value * (trace.decline ? kHzPerFraction : 1.0);
  }

  const std::vector<Trace>& traces_;
  std::size_t trials_;
  std::shared_ptr<const RateCurrentTable> table_;
  std::chrono::nanoseconds table_step_{0};
  int evaluations_ = 0;
};

/// What `merkel fit` may change in a model.
BoundFields fitted_keys(TactileModel::Parameters& model) {
  BoundFields keys = bind_fields(model.adaptation);
  for (BoundField& key : neuron_fields(model)) keys.push_back(std::move(key));
  std::erase_if(keys, [](const BoundField& key) { return !key.field->fitted; });
  return keys;
}

Expected<std::vector<FitParameter>, SetupError> chosen(const TactileModel::Parameters& scene,
                                                       const std::vector<std::string>& names) {
  const std::vector<FitParameter> all = fit_parameters(scene.kind());
  std::vector<std::string> known;
  for (const FitParameter& parameter : all) known.push_back(parameter.name);
  std::vector<FitParameter> found;
  for (const std::string& name : names) {
    const auto at = std::find(known.begin(), known.end(), name);
    if (at == known.end()) {
      const std::string nearest = nearest_name(name, known);
      std::string list;
      for (const std::string& each : known) list.append(list.empty() ? "" : ", ").append(each);
      return bad_input(
          "no parameter \"" + name + "\" can be fitted" +
          (nearest.empty() ? ": there are " + list : "; did you mean " + nearest + "?"));
    }
    const FitParameter& parameter = all[static_cast<std::size_t>(at - known.begin())];
    if (std::any_of(found.begin(), found.end(),
                    [&](const FitParameter& other) { return other.name == name; })) {
      return bad_input("the parameter " + name + " is named twice: leave one out");
    }
    TactileModel::Parameters copy = scene;
    if (!(*parameter.in(copy) > 0.0)) {
      return bad_input("the parameter " + name + " is 0 in the scene: give it a positive start");
    }
    found.push_back(parameter);
  }
  if (found.empty()) return bad_input("name at least one parameter to fit");
  return found;
}

}  // namespace

bool FitResult::determined() const {
  return measurements > parameters.size() && condition < kLargestCondition &&
         std::all_of(parameters.begin(), parameters.end(), [](const FittedParameter& parameter) {
           return parameter.relative_error < kLargestError;
         });
}

std::vector<FitParameter> fit_parameters(NeuronKind kind) {
  TactileModel::Parameters model;
  set_kind(model, kind);
  std::vector<FitParameter> all;
  for (const BoundField& key : fitted_keys(model)) {
    all.push_back({std::string(key.field->key), std::string(key.table)});
  }
  return all;
}

double* FitParameter::in(TactileModel::Parameters& model) const {
  const BoundFields keys = fitted_keys(model);
  const auto found = std::find_if(keys.begin(), keys.end(), [&](const BoundField& key) {
    return key.field->key == name && key.table == table;
  });
  return std::get<double*>(found->value);
}

Expected<FitResult, SetupError> fit(TactileModel::Parameters& scene,
                                    const std::vector<DataSet>& given,
                                    const std::vector<std::string>& names, std::size_t trials,
                                    int most_evaluations,
                                    const std::function<void(double)>& progress) {
  if (!scene.energy_driven()) {
    return bad_input(
        "only neurons that energy density drives can be fitted: start from goodwin or goodwin-cs");
  }
  std::vector<DataSet> sets = given;
  std::erase_if(sets, [](const DataSet& set) { return !set.fit; });
  if (sets.empty()) return bad_input("the data file holds no rates or declines to fit to");
  const auto parameters = chosen(scene, names);
  if (!parameters) return Unexpected<SetupError>(parameters.error());
  const auto traces = traces_of(scene, sets);
  if (!traces) return bad_input(traces.error().key + " " + traces.error().reason);

  Answers answers(*traces, trials);
  const Eigen::VectorXd measured = answers.measured();
  const Eigen::VectorXd weights = answers.weights();
  const auto with = [&](const std::vector<double>& logarithms) {
    TactileModel::Parameters changed = scene;
    for (std::size_t k = 0; k < logarithms.size(); ++k) {
      *(*parameters)[k].in(changed) = std::exp(logarithms[k]);
    }
    return changed;
  };
  const auto valid = [](const TactileModel::Parameters& p) {
    const auto* const integrate = std::get_if<IntegrateAndFireAfferent>(&p.afferent);
    return p.adaptation.check() &&
           (integrate == nullptr || integrate->neuron.check(std::chrono::microseconds{500}));
  };
  const auto cost = [&](const std::vector<double>& logarithms) {
    const TactileModel::Parameters changed = with(logarithms);
    if (!valid(changed)) return 1e6;
    const Eigen::VectorXd difference = answers.of(changed) - measured;
    if (progress) {
      progress(std::min(1.0, static_cast<double>(answers.evaluations()) / most_evaluations));
    }
    return (weights.array() * difference.array().square()).sum();
  };

  FitResult result;
  std::vector<double> at;
  for (const FitParameter& parameter : *parameters) at.push_back(std::log(*parameter.in(scene)));
  const std::vector<double> start = at;
  result.cost_before = cost(start);

  const std::unique_ptr<nlopt_opt_s, void (*)(nlopt_opt_s*)> optimiser(
      nlopt_create(NLOPT_LN_SBPLX, static_cast<unsigned>(at.size())), nlopt_destroy);
  std::vector<double> low = start;
  std::vector<double> high = start;
  for (std::size_t k = 0; k < start.size(); ++k) {
    low[k] -= std::log(kWidest);
    high[k] += std::log(kWidest);
  }
  std::function<double(const std::vector<double>&)> objective = cost;
  nlopt_set_lower_bounds(optimiser.get(), low.data());
  nlopt_set_upper_bounds(optimiser.get(), high.data());
  nlopt_set_initial_step1(optimiser.get(), 0.1);
  nlopt_set_xtol_abs1(optimiser.get(), 1e-3);
  nlopt_set_maxeval(optimiser.get(), most_evaluations);
  nlopt_set_min_objective(
      optimiser.get(),
      [](unsigned n, const double* x, double* /*gradient*/, void* function) {
        return (*static_cast<decltype(objective)*>(function))({x, x + n});
      },
      &objective);
  if (nlopt_optimize(optimiser.get(), at.data(), &result.cost_after) < 0) {
    return unavailable("the optimiser gave up: start from other parameters");
  }
  // Counts of impulses are steps: where no step led down, the start stays.
  if (result.cost_after >= result.cost_before) {
    at = start;
    result.cost_after = result.cost_before;
  }

  // The curvature of the cost from the slopes of the answers (Gauss and Newton).
  const auto count = static_cast<Eigen::Index>(at.size());
  Eigen::MatrixXd slopes(measured.size(), count);
  for (Eigen::Index k = 0; k < count; ++k) {
    constexpr double kStep = 0.1;
    std::vector<double> above = at;
    std::vector<double> below = at;
    above[static_cast<std::size_t>(k)] += kStep;
    below[static_cast<std::size_t>(k)] -= kStep;
    slopes.col(k) = (answers.of(with(above)) - answers.of(with(below))) / (2.0 * kStep);
  }
  const Eigen::MatrixXd curvature = slopes.transpose() * weights.asDiagonal() * slopes;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(curvature);
  const double smallest = eigen.eigenvalues().minCoeff();
  result.condition = smallest > 0.0 ? eigen.eigenvalues().maxCoeff() / smallest
                                    : std::numeric_limits<double>::infinity();
  const double freedom = std::max(1.0, static_cast<double>(measured.size() - count));
  const Eigen::MatrixXd covariance =
      smallest > 0.0
          ? Eigen::MatrixXd(curvature.inverse() * result.cost_after / freedom)
          : Eigen::MatrixXd::Constant(count, count, std::numeric_limits<double>::infinity());
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto i = static_cast<std::size_t>(k);
    result.parameters.push_back({.name = (*parameters)[i].name,
                                 .table = (*parameters)[i].table,
                                 .before = std::exp(start[i]),
                                 .after = std::exp(at[i]),
                                 .relative_error = std::sqrt(covariance(k, k))});
    std::vector<double> row;
    for (Eigen::Index j = 0; j < count; ++j) {
      row.push_back(covariance(k, j) / std::sqrt(covariance(k, k) * covariance(j, j)));
    }
    result.correlation.push_back(std::move(row));
  }
  result.evaluations = answers.evaluations();
  result.measurements = static_cast<std::size_t>(measured.size());
  scene = with(at);
  return result;
}

}  // namespace merkel
