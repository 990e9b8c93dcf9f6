#pragma once

#include <cstdint>
#include <vector>

#include "core/scene/tactile_model.hpp"

namespace merkel {

/// The result of one receptor draw under one press.
struct PressedPatch {
  std::vector<double> rate_hz;           ///< of each neuron
  std::vector<double> receptors;         ///< of each neuron
  std::vector<double> mean_distance_mm;  ///< between each neuron's receptors and the press
};

/// The paper's fingertip under a constant press: a sphere of radius R, `depth_mm` deep at (x, y),
/// for a duration, from rest. The parameters must be valid.
[[nodiscard]] PressedPatch press_patch(const TactileModel::Parameters& parameters,
                                       const ContactInput& press, double duration_s);

}  // namespace merkel
