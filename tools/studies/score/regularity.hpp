#pragma once

#include <vector>

#include "core/scene/tactile_model.hpp"

namespace merkel {

/// The regularity of an afferent at a steady rate, and its intervals.
struct Regularity {
  double wanted_hz = 0.0;
  double rate_hz = 0.0;
  double cv = 0.0;        ///< standard deviation of the intervals over their mean
  double count_sd = 0.0;  ///< of the impulses in a second
  std::vector<double> intervals_ms;
};
/// Regularity of neurons driven by energy density, at a rate held by a constant drive.
[[nodiscard]] Regularity regularity_at(const TactileModel::Parameters& scene, double rate_hz);

/// The rate at constant drives, without adaptation: the f–I curve.
struct DriveRate {
  double drive_hz = 0.0;
  double rate_hz = 0.0;
};
[[nodiscard]] std::vector<DriveRate> rates_by_drive(const TactileModel::Parameters& scene);

}  // namespace merkel
