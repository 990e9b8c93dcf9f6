#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "drivers/calibration/probe_calibration.hpp"

namespace merkel {

/// The readings taken while a known load or depth was applied.
struct CalibrationPoint {
  double known = 0.0;            ///< N or mm
  std::vector<double> readings;  ///< uncalibrated, N or mm
};

/// Checks that the load was still while each point was measured: the readings must drift by less
/// than 2 % of the span of the points and scatter by less than 5 % (rms). \return the error, or an
/// empty string. \param gain  N or mm per unit of the readings
[[nodiscard]] std::string moving_point(std::span<const CalibrationPoint> points, double gain);

/// Computes zero, gain, residual and noise from one point (a tare: the gain is kept) or from
/// several (a least-squares line). Fails if points have no readings, moved, or all have the same
/// readings.
[[nodiscard]] Expected<ChannelCalibration, SetupError> fit_calibration(
    const ChannelCalibration& before, std::span<const CalibrationPoint> points);

}  // namespace merkel
