#pragma once

#include <cstdint>

namespace merkel {

/// White noise in a membrane's current. Every afferent has its own, which depends on the seed, the
/// afferent's number and the number of steps since reset alone: a replay has the same.
struct NeuronNoise {
  double sigma = 0.0;  ///< a step of dt adds sigma·√dt·ξ to the potential; 0 is none
  std::uint64_t seed = 1;
  /// Noise grows with the drive I: sigma·√min(1, I/this), so that untouched afferents are silent,
  /// as recorded ones are. 0: the same noise at any drive.
  double full_drive_Hz = 5.0;
};

}  // namespace merkel
