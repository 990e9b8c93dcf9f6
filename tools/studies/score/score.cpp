#include "tools/studies/score/score.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>

#include "core/scene/afferents.hpp"
#include "core/units.hpp"
#include "tools/studies/score/parallel_items.hpp"
#include "tools/studies/score/pin_array.hpp"
#include "tools/studies/score/trials.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

double squared_correlation(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.size() < 3) return kNone;
  const auto n = static_cast<double>(a.size());
  double sa = 0.0;
  double sb = 0.0;
  double saa = 0.0;
  double sbb = 0.0;
  double sab = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    sa += a[i];
    sb += b[i];
    saa += a[i] * a[i];
    sbb += b[i] * b[i];
    sab += a[i] * b[i];
  }
  const double covariance = sab - sa * sb / n;
  const double variances = (saa - sa * sa / n) * (sbb - sb * sb / n);
  return variances > 0.0 ? covariance * covariance / variances : kNone;
}

/// 1 − SSE/SST of predictions a of measurements b.
double explained_variance(const std::vector<double>& a, const std::vector<double>& b) {
  if (b.size() < 2) return kNone;
  const double mean = std::accumulate(b.begin(), b.end(), 0.0) / static_cast<double>(b.size());
  double missed = 0.0;
  double total = 0.0;
  for (std::size_t i = 0; i < b.size(); ++i) {
    missed += (a[i] - b[i]) * (a[i] - b[i]);
    total += (b[i] - mean) * (b[i] - mean);
  }
  return total > 0.0 ? 1.0 - missed / total : kNone;
}

/// Neurons of the scene's kind with the energy density as drive in Hz, without adaptation.
Afferents driven_neurons(const TactileModel::Parameters& scene, std::size_t count) {
  TactileModel::Parameters bare = scene;
  bare.adaptation = {
      .gain_Hz_per_kPa = 1.0, .fast_weight = 0.0, .slow_weight = 0.0, .compression_ms = 0.0};
  return *Afferents::create(bare, 0, count, *afferent_tables_of(bare));
}

/// Spike times of each neuron under constant drives, s, after one second of settling.
std::vector<std::vector<double>> trains(Afferents& neurons, nanoseconds step,
                                        const std::vector<double>& drive, double seconds) {
  neurons.reset();
  std::vector<std::vector<double>> times(drive.size());
  SpikeBuffer spikes(drive.size() * 12);
  const int steps = std::max(1, static_cast<int>(milliseconds{10} / step));
  const nanoseconds end = units::nanoseconds_from_s(1.0 + seconds);
  for (nanoseconds time{0}; time < end; time += steps * step) {
    spikes.clear();
    neurons.advance(drive, drive, steps, time, spikes, nullptr);
    spikes.sort();
    for (const SpikeEvent& spike : spikes.events()) {
      const double at = units::s_from(spike.time) - 1.0;
      if (at >= 0.0) times[spike.neuron - 1].push_back(at);
    }
  }
  return times;
}

double mean_rate(const std::vector<std::vector<double>>& times, double seconds) {
  double sum = 0.0;
  for (const auto& train : times) sum += static_cast<double>(train.size());
  return sum / (seconds * static_cast<double>(times.size()));
}

/// The contact after each increment.
std::vector<std::optional<TipField>> fields_of(
    const PinArrayTrials& array, const std::vector<PinArrayTrials::Increment>& increments,
    std::size_t threads) {
  std::vector<std::optional<TipField>> fields(increments.size());
  for_each_item(increments.size(), threads, [&](std::size_t /*worker*/, std::size_t i) {
    fields[i].emplace(array.field(increments[i]));
  });
  return fields;
}

}  // namespace

double root_mean_square_error(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum / static_cast<double>(a.size()));
}

Expected<std::vector<SetScore>, ParameterError> score_sets(
    const TactileModel::Parameters& scene, const std::vector<DataSet>& sets, std::size_t trials,
    const std::function<void(double)>& progress, std::size_t threads) {
  struct Point {
    const DataSet::Point* point;
    Answer answer{.value = kNone, .count_sd = kNone};
    bool skipped = false;
    std::optional<ParameterError> error = std::nullopt;
  };
  std::vector<Point> points;
  for (const DataSet& set : sets) {
    for (const DataSet::Point& point : set.points) points.push_back({.point = &point});
  }
  std::vector<std::optional<Trials>> models(std::max<std::size_t>(1, threads));
  std::mutex mutex;
  std::size_t done = 0;
  for_each_item(points.size(), threads, [&](std::size_t worker, std::size_t i) {
    const Stimulus& stimulus = points[i].point->stimulus;
    if (std::isinf(stimulus.indenter.radius_mm) && std::isinf(scene.skin.radius_mm)) {
      points[i].skipped = true;
      return;
    }
    std::optional<Trials>& model = models[worker];
    if (!model || !model->fits(stimulus)) {
      auto made = Trials::create(scene, stimulus, trials);
      if (!made) {
        points[i].error = made.error();
        return;
      }
      model.emplace(std::move(*made));
    }
    points[i].answer = answer_of(stimulus, model->run(stimulus));
    const std::lock_guard lock(mutex);
    if (progress) progress(static_cast<double>(++done) / static_cast<double>(points.size()));
  });
  std::vector<SetScore> scores;
  auto next = points.begin();
  for (const DataSet& set : sets) {
    SetScore score;
    score.set = &set;
    std::vector<double> measured;
    std::vector<double> answered;
    for (std::size_t k = 0; k < set.points.size(); ++k, ++next) {
      if (next->error) return Unexpected<ParameterError>(*next->error);
      score.predicted.push_back(next->answer.value);
      score.count_sd.push_back(next->answer.count_sd);
      if (next->skipped) {
        ++score.skipped;
        continue;
      }
      answered.push_back(next->answer.value);
      measured.push_back(next->point->measured);
    }
    score.rmse = answered.empty() ? kNone : root_mean_square_error(answered, measured);
    score.r2 = squared_correlation(answered, measured);
    score.R2 = explained_variance(answered, measured);
    scores.push_back(std::move(score));
  }
  return scores;
}

Regularity regularity_at(const TactileModel::Parameters& scene, double rate_hz) {
  constexpr std::size_t kNeurons = 32;
  constexpr double kSeconds = 10.0;
  Afferents neurons = driven_neurons(scene, kNeurons);
  // The leak reduces the drive: correct it until the rate is right.
  double drive = rate_hz;
  std::vector<std::vector<double>> times;
  Regularity found{.wanted_hz = rate_hz};
  for (int attempt = 0; attempt < 5; ++attempt) {
    times = trains(neurons, scene.step, std::vector<double>(kNeurons, drive), kSeconds);
    found.rate_hz = mean_rate(times, kSeconds);
    drive += rate_hz - found.rate_hz;
  }
  double sum = 0.0;
  double sum2 = 0.0;
  double seconds = 0.0;
  double counts = 0.0;
  double counts2 = 0.0;
  for (const auto& train : times) {
    for (std::size_t k = 1; k < train.size(); ++k) {
      const double interval = 1e3 * (train[k] - train[k - 1]);
      found.intervals_ms.push_back(interval);
      sum += interval;
      sum2 += interval * interval;
    }
    for (int second = 0; second < static_cast<int>(kSeconds); ++second) {
      const auto count =
          static_cast<double>(std::count_if(train.begin(), train.end(), [second](double t) {
            return t >= second && t < second + 1;
          }));
      seconds += 1.0;
      counts += count;
      counts2 += count * count;
    }
  }
  const auto n = static_cast<double>(std::max<std::size_t>(1, found.intervals_ms.size()));
  const double mean = sum / n;
  found.cv = mean > 0.0 ? std::sqrt(std::max(0.0, sum2 / n - mean * mean)) / mean : kNone;
  found.count_sd =
      std::sqrt(std::max(0.0, counts2 / seconds - counts / seconds * counts / seconds));
  return found;
}

std::vector<DriveRate> rates_by_drive(const TactileModel::Parameters& scene) {
  constexpr double kSeconds = 4.0;
  std::vector<double> drives;
  for (int k = 0; k <= 100; ++k) drives.push_back(5.0 * k);
  Afferents neurons = driven_neurons(scene, drives.size());
  const auto times = trains(neurons, scene.step, drives, kSeconds);
  std::vector<DriveRate> rates;
  for (std::size_t k = 0; k < drives.size(); ++k) {
    rates.push_back(
        {.drive_hz = drives[k], .rate_hz = static_cast<double>(times[k].size()) / kSeconds});
  }
  return rates;
}

Expected<std::vector<FieldArea>, ParameterError> field_areas(const TactileModel::Parameters& scene,
                                                             const Recordings::FieldAreas& areas,
                                                             std::size_t trials,
                                                             std::size_t threads) {
  std::vector<FieldArea> found(areas.points.size());
  const auto measure = [&](FieldArea& area, const std::function<double(double, double)>& response) {
    area.response = response(0.0, 0.0);
    if (area.response < 1.0) return;
    const auto radius = [&](bool across) {
      double inside = 0.0;
      double outside = 6.0;
      while (outside - inside > 0.02) {
        const double middle = 0.5 * (inside + outside);
        const bool evokes = (across ? response(0.0, middle) : response(middle, 0.0)) >= 1.0;
        (evokes ? inside : outside) = middle;
      }
      return inside;
    };
    area.area_mm2 = std::numbers::pi * radius(false) * radius(true);
  };
  if (areas.array.pins > 1) {
    auto array = PinArrayTrials::create(scene, areas.array, trials);
    if (!array) return Unexpected<ParameterError>(array.error());
    std::vector<PinArrayTrials::Increment> increments;
    for (const auto& point : areas.points) increments.push_back({1, point.depth_mm});
    const auto fields = fields_of(*array, increments, threads);
    for (std::size_t i = 0; i < found.size(); ++i) {
      measure(found[i], [&](double x, double y) { return array->response(*fields[i], x, y); });
    }
    return found;
  }
  Stimulus stimulus;
  stimulus.indenter.tip = Indenter::Tip::kPin;
  stimulus.indenter.pin.diameter_mm = areas.array.diameter_mm;
  auto model = Trials::create(scene, stimulus, trials);
  if (!model) return Unexpected<ParameterError>(model.error());
  const double none = answer_of(stimulus, model->run(stimulus)).value;
  for (std::size_t i = 0; i < found.size(); ++i) {
    stimulus.level = areas.points[i].depth_mm;
    measure(found[i], [&](double x, double y) {
      stimulus.offset_across = y > 0.0;
      stimulus.offset_mm = std::max(x, y);
      return answer_of(stimulus, model->run(stimulus)).value - none;
    });
  }
  return found;
}

Expected<std::vector<double>, ParameterError> surround_ratios(const TactileModel::Parameters& scene,
                                                              const Recordings::Surround& surround,
                                                              std::size_t trials,
                                                              std::size_t threads) {
  auto array = PinArrayTrials::create(scene, surround.array, trials);
  if (!array) return Unexpected<ParameterError>(array.error());
  std::vector<PinArrayTrials::Increment> increments = {{1, surround.depth_mm}};
  for (const auto& point : surround.points) increments.push_back({point.pins, surround.depth_mm});
  const auto fields = fields_of(*array, increments, threads);
  const double alone = array->response(*fields[0], 0.0, 0.0);
  std::vector<double> ratios;
  for (std::size_t i = 1; i < fields.size(); ++i) {
    ratios.push_back(alone > 0.0 ? array->response(*fields[i], 0.0, 0.0) / alone : kNone);
  }
  return ratios;
}

bool fitted_to(const DataSet& set) {
  static const Recordings published = published_recordings();
  return set.fit &&
         std::any_of(published.sets.begin(), published.sets.end(), [&](const DataSet& known) {
           return known.section == set.section && known.name == set.name &&
                  known.points.size() == set.points.size() &&
                  std::equal(known.points.begin(), known.points.end(), set.points.begin(),
                             [](const DataSet::Point& a, const DataSet::Point& b) {
                               return a.x == b.x && a.measured == b.measured;
                             });
         });
}

PeerScores peers_of(const std::string& set_name) {
  struct Row {
    const char* set;
    PeerScores scores;
  };
  // TouchSim: Saal et al. 2017 (doi 10.1073/pnas.1704856114).
  static const Row kRows[] = {{"curvature × force, 0.098 N", {32.0, 35.0}},
                              {"curvature × force, 0.196 N", {57.0, 54.0}},
                              {"vibration, 20 Hz", {2.0, kNone}},
                              {"vibration, 100 Hz", {6.7, kNone}}};
  for (const Row& row : kRows) {
    if (set_name == row.set) return row.scores;
  }
  return {kNone, kNone};
}

}  // namespace merkel
