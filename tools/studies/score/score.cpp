#include "tools/studies/score/score.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <numeric>
#include <optional>
#include <utility>

#include "tools/studies/score/parallel_items.hpp"
#include "tools/studies/score/trials.hpp"

namespace merkel {
namespace {

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
  };
  std::vector<Point> points;
  for (const DataSet& set : sets) {
    for (const DataSet::Point& point : set.points) points.push_back({.point = &point});
  }
  std::vector<std::optional<Trials>> models(std::max<std::size_t>(1, threads));
  std::mutex mutex;
  std::size_t done = 0;
  const auto press = [&](std::size_t worker, std::size_t i) -> std::optional<ParameterError> {
    const Stimulus& stimulus = points[i].point->stimulus;
    if (stimulus.indenter.sphere() != nullptr &&
        std::isinf(stimulus.indenter.sphere()->radius_mm) && std::isinf(scene.skin.radius_mm)) {
      points[i].skipped = true;
      return std::nullopt;
    }
    std::optional<Trials>& model = models[worker];
    if (!model || !model->fits(stimulus)) {
      auto made = Trials::create(scene, stimulus, trials);
      if (!made) return made.error();
      model.emplace(std::move(*made));
    }
    points[i].answer = answer_of(stimulus, model->run(stimulus));
    const std::lock_guard lock(mutex);
    if (progress) progress(static_cast<double>(++done) / static_cast<double>(points.size()));
    return std::nullopt;
  };
  if (const auto error = try_each_item(points.size(), threads, press)) {
    return Unexpected<ParameterError>(*error);
  }
  std::vector<SetScore> scores;
  auto next = points.begin();
  for (const DataSet& set : sets) {
    SetScore score;
    score.set = &set;
    std::vector<double> measured;
    std::vector<double> answered;
    for (std::size_t k = 0; k < set.points.size(); ++k, ++next) {
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
