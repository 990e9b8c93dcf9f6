#pragma once

#include <cstdint>

namespace merkel {

/// White noise in the membrane current. Each afferent has its own noise, which depends only on the
/// seed, the afferent's number and the number of steps since reset, so a replay reproduces it.
struct NeuronNoise {
  double sigma = 0.0;  ///< a step dt adds sigma·√dt·ξ to the potential; 0: no noise
  std::uint64_t seed = 1;
  /// Noise grows with the drive I: sigma·√min(1, I/full_drive_Hz). Untouched afferents are
  /// therefore silent, as in recordings. 0: the same noise at any drive.
  double full_drive_Hz = 5.0;
};

}  // namespace merkel
