#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "drivers/calibration/probe_calibration.hpp"

namespace merkel {

/// What was read while a known load or depth was applied.
struct CalibrationPoint {
  double known = 0.0;            ///< N or mm
  std::vector<double> readings;  ///< as the device gives them, N or mm
};

/// Whether the load moved while a point was measured: the readings drifted by more than 2 % of the
/// span of the points, or scattered by more than 5 % (rms). Returns a sentence; empty where it was
/// still. \param gain  N or mm per unit of the readings
[[nodiscard]] std::string moving_point(std::span<const CalibrationPoint> points, double gain);

/// Zero, gain, residual and noise from one point (a tare: the gain stays) or from several (the line
/// with least squares). Fails where the points have no readings, moved, or have all the same
/// readings.
[[nodiscard]] Expected<ChannelCalibration, SetupError> fit_calibration(
    const ChannelCalibration& before, std::span<const CalibrationPoint> points);

}  // namespace merkel
