#include "drivers/calibration/calibration_fit.hpp"

#include <cmath>
#include <numeric>

#include "core/parameters/parameter_error.hpp"

namespace merkel {
namespace {

constexpr std::size_t kFewest = 10;
constexpr double kNoisesApart = 3.0;  ///< readings of two points must differ by so much noise

}  // namespace

Expected<ChannelCalibration, SetupError> fit_calibration(const ChannelCalibration& before,
                                                         std::span<const CalibrationPoint> points) {
  std::vector<double> means;
  double squares = 0.0;
  double readings = 0.0;
  for (const CalibrationPoint& point : points) {
    if (point.readings.size() < kFewest) {
      return bad_input("at " + shortest_decimal(point.known) + " only " +
                       std::to_string(point.readings.size()) + " readings came: at least " +
                       std::to_string(kFewest) + " are needed, so measure longer");
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
    fitted.residual = 0.0;
  } else {
    const auto n = static_cast<double>(points.size());
    double mean_reading = 0.0;
    double mean_known = 0.0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      mean_reading += means[i] / n;
      mean_known += points[i].known / n;
    }
    double xx = 0.0;
    double xy = 0.0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      xx += (means[i] - mean_reading) * (means[i] - mean_reading);
      xy += (means[i] - mean_reading) * (points[i].known - mean_known);
    }
    const double spread = std::sqrt(xx / n);
    if (!(spread > kNoisesApart * noise) || xy == 0.0) {
      return bad_input(
          "the readings do not differ between the points by more than their noise: apply what was "
          "asked for, and name points that are apart");
    }
    fitted.gain = xy / xx;
    fitted.zero = mean_reading - mean_known / fitted.gain;
    double rest = 0.0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double error = fitted.gain * (means[i] - fitted.zero) - points[i].known;
      rest += error * error / n;
    }
    fitted.residual = std::sqrt(rest);
  }
  fitted.noise = std::fabs(fitted.gain) * noise;
  return fitted;
}

}  // namespace merkel
