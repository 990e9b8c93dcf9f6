#pragma once

#include <cstddef>

#include "core/parameter_error.hpp"
#include "core/skin/bar_contact.hpp"
#include "core/skin/pin_contact.hpp"
#include "core/skin/skin_material.hpp"

namespace merkel {

/// The rigid tip of a probe.
struct Indenter {
  enum class Tip { kSphere, kBars, kPin };
  /// Which reading of the probe drives the contact.
  enum class Control { kDepth, kForce };

  Tip tip = Tip::kSphere;
  double radius_mm = 2.0;  ///< of the sphere; infinity is a flat plate, on curved skin only
  BarTip bars;             ///< where the tip is bars
  PinTip pin;              ///< where the tip is a pin
  Control control = Control::kDepth;
  std::size_t patch = 0;  ///< which of the model's patches it presses on

  [[nodiscard]] Expected<void, ParameterError> check(const SkinParameters& skin) const;
};

}  // namespace merkel
