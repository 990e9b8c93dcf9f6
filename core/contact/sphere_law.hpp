#pragma once

#include <memory>
#include <optional>

#include "core/contact/bonded_layer.hpp"
#include "core/contact/contact_state.hpp"
#include "core/contact/hertz_contact.hpp"
#include "core/contact/sneddon_contact.hpp"
#include "core/realtime_tag.hpp"
#include "core/skin/skin_material.hpp"

namespace merkel {

/// The contact law that a skin selects for a sphere: Hertz on a half-space, Sneddon's exact sphere,
/// or a layer on bone. Real-time: yes, after construction.
class SphereLaw {
 public:
  /// \param radius_mm  of the sphere; infinity is a flat plate, on curved skin only
  SphereLaw(const SkinParameters& skin, double radius_mm);

  /// The contact at an indentation depth. A depth ≤ 0 means no contact.
  [[nodiscard]] ContactState at_depth(double depth_mm) const noexcept MERKEL_REALTIME;
  /// The contact under a force. A force ≤ 0 means no contact.
  [[nodiscard]] ContactState at_force(double force_mN) const noexcept MERKEL_REALTIME;

  /// R* = 1/(1/R + 1/R_skin).
  [[nodiscard]] double effective_radius_mm() const noexcept { return hertz_.effective_radius_mm(); }
  /// The Hertz law, for comparison with the others.
  [[nodiscard]] const HertzContact& hertz() const noexcept { return hertz_; }

 private:
  [[nodiscard]] double layer_factor(double chi) const noexcept;
  /// The contact with the moduli of undeformed skin.
  [[nodiscard]] ContactState elastic_at_depth(double depth_mm) const noexcept;

  HertzContact hertz_;
  std::optional<SneddonContact> sneddon_;
  SkinParameters skin_;
  std::shared_ptr<const BondedLayer> exact_layer_;  ///< null: Dimitriadis polynomial
};

}  // namespace merkel
