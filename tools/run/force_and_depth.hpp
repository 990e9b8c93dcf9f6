#pragma once

#include <cstddef>
#include <optional>

#include "core/scene/tactile_model.hpp"
#include "realtime/pipeline.hpp"

namespace merkel {

/// Force and depth that a probe measured at its deepest press, and the force that the contact law
/// gives for this depth.
struct ForceAndDepth {
  double depth_mm = 0.0;
  double force_N = 0.0;
  double model_force_N = 0.0;

  /// Measured force over the model's.
  [[nodiscard]] double ratio() const noexcept { return force_N / model_force_N; }
  /// True if they differ by more than a factor of 1.5.
  [[nodiscard]] bool disagrees() const noexcept { return ratio() > 1.5 || ratio() < 1.0 / 1.5; }
};

/// Empty for a probe that does not measure both or never touched the skin.
[[nodiscard]] std::optional<ForceAndDepth> force_and_depth(const RunReport::ProbeReport& probe,
                                                           const TactileModel& model,
                                                           std::size_t indenter);

}  // namespace merkel
