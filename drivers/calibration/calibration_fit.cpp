#include "drivers/calibration/calibration_fit.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include "core/math/line_fit.hpp"
#include "core/parameters/parameter_error.hpp"

namespace merkel {
namespace {

constexpr std::size_t kMinReadings = 10;
constexpr double kMaxDrift = 0.02;    ///< as a share of the span of the points
constexpr double kMaxNoise = 0.05;    ///< rms, as a share of the span
constexpr double kNoisesApart = 3.0;  ///< least distance of two points' readings, times the noise

struct Motion {
  double drift = 0.0;  ///< between the first and the last third of the readings
  double noise = 0.0;  ///< rms about their mean
};

Motion motion_of(std::span<const double> readings) {
  const auto mean = [](std::span<const double> some) {
    return std::accumulate(some.begin(), some.end(), 0.0) / static_cast<double>(some.size());
  };
  const std::size_t third = readings.size() / 3;
  const double middle = mean(readings);
  double squares = 0.0;
  for (const double reading : readings) squares += (reading - middle) * (reading - middle);
  return {.drift = std::fabs(mean(readings.last(third)) - mean(readings.first(third))),
          .noise = std::sqrt(squares / static_cast<double>(readings.size()))};
}

}  // namespace

std::string moving_point(std::span<const CalibrationPoint> points, double gain) {
  if (points.size() < 2) return {};
  const auto [least, most] = std::minmax_element(
      points.begin(), points.end(), [](const auto& a, const auto& b) { return a.known < b.known; });
  const double span = most->known - least->known;
  for (const CalibrationPoint& point : points) {
    if (point.readings.size() < kMinReadings) continue;
    const Motion motion = motion_of(point.readings);
    const bool drifts = std::fabs(gain) * motion.drift > kMaxDrift * span;
    const bool scatters = std::fabs(gain) * motion.noise > kMaxNoise * span;
    if (!drifts && !scatters) continue;
    const double moved = std::fabs(gain) * (drifts ? motion.drift : motion.noise);
    return "at " + shortest_decimal(point.known) + " the readings " +
           (drifts ? "drifted" : "scattered") + " by " +
           shortest_decimal(std::round(moved * 1e4) * 1e-4) + ", which is " +
           shortest_decimal(std::round(100.0 * moved / span)) +
           " % of the range of the calibration points: keep the load constant and measure again";
  }
  return {};
}

Expected<ChannelCalibration, SetupError> fit_calibration(const ChannelCalibration& before,
                                                         std::span<const CalibrationPoint> points) {
  std::vector<double> means;
  double squares = 0.0;
  double readings = 0.0;
  for (const CalibrationPoint& point : points) {
    if (point.readings.size() < kMinReadings) {
      return bad_input("at " + shortest_decimal(point.known) + " only " +
                       std::to_string(point.readings.size()) + " readings arrived: at least " +
                       std::to_string(kMinReadings) +
                       " are needed; check that the device sends, and measure longer");
    }
    const auto count = static_cast<double>(point.readings.size());
    const double mean = std::accumulate(point.readings.begin(), point.readings.end(), 0.0) / count;
    for (const double reading : point.readings) squares += (reading - mean) * (reading - mean);
    readings += count;
    means.push_back(mean);
  }
  if (points.empty()) return bad_input("a calibration needs at least one known point");
  const double noise = std::sqrt(squares / readings);

  ChannelCalibration fitted = before;
  if (points.size() == 1) {
    fitted.zero = means[0] - points[0].known / before.gain;
  } else {
    std::vector<std::pair<double, double>> pairs;  // mean reading, known
    for (std::size_t i = 0; i < points.size(); ++i) pairs.emplace_back(means[i], points[i].known);
    const FittedLine line = fit_line(pairs);
    const double spread = std::sqrt(line.xx / line.count);
    if (!(spread > kNoisesApart * noise) || line.xy == 0.0) {
      return bad_input(
          "the readings at the points differ by less than their noise: apply the requested loads, "
          "and choose points that are further apart");
    }
    fitted.gain = line.slope();
    fitted.zero = line.mean_x - line.mean_y / fitted.gain;
    double rest = 0.0;
    for (const auto& [mean, known] : pairs) {
      const double error = fitted.gain * (mean - fitted.zero) - known;
      rest += error * error / line.count;
    }
    fitted.residual = std::sqrt(rest);
    const auto [least, most] =
        std::minmax_element(points.begin(), points.end(),
                            [](const auto& a, const auto& b) { return a.known < b.known; });
    fitted.range = {least->known, most->known};
    if (std::string sentence = moving_point(points, fitted.gain); !sentence.empty()) {
      return bad_input(sentence);
    }
  }
  fitted.noise = std::fabs(fitted.gain) * noise;
  return fitted;
}

}  // namespace merkel
