#pragma once

#include <span>
#include <vector>

#include "core/expected.hpp"
#include "drivers/calibration/probe_calibration.hpp"

namespace merkel {

/// What was read while a known load or depth was applied.
struct CalibrationPoint {
  double known = 0.0;            ///< N or mm
  std::vector<double> readings;  ///< as the device gives them, N or mm
};

/// Zero, gain, residual and noise from one point (a tare: the gain stays) or from several (the line
/// with least squares). Fails where the points have no readings, or all the same.
[[nodiscard]] Expected<ChannelCalibration, SetupError> fit_calibration(
    const ChannelCalibration& before, std::span<const CalibrationPoint> points);

}  // namespace merkel
