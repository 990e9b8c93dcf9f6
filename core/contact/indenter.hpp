#pragma once

#include <cstddef>
#include <string_view>

#include "core/contact/bar_contact.hpp"
#include "core/contact/pin_contact.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/skin/skin_material.hpp"

namespace merkel {

/// The error for probes that mix depth and force control.
inline constexpr std::string_view kMixedControl =
    "must be the same for all probes, but mixes \"depth\" and \"force\": use one of them for all "
    "probes";

/// The rigid tip of a probe.
struct Indenter {
  enum class Tip { kSphere, kBars, kPin };
  /// Which reading of the probe drives the contact.
  enum class Control { kDepth, kForce };

  Tip tip = Tip::kSphere;
  double radius_mm = 2.0;  ///< of the sphere; infinity is a flat plate, on curved skin only
  BarTip bars;             ///< if the tip is bars
  PinTip pin;              ///< if the tip is a pin
  Control control = Control::kDepth;
  std::size_t patch = 0;  ///< index of the patch that it presses on

  [[nodiscard]] static FieldTable fields();
  [[nodiscard]] Expected<void, ParameterError> check(const SkinParameters& skin) const;
};

}  // namespace merkel
