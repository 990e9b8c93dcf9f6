#pragma once

#include <optional>

#include "core/contact/contact_state.hpp"
#include "core/contact/hertz_contact.hpp"
#include "core/contact/sneddon_contact.hpp"
#include "core/realtime_tag.hpp"
#include "core/skin/skin_material.hpp"

namespace merkel {

/// How much stiffer skin of thickness h, bonded to bone, is than a half-space: the ratio of its
/// force to the Hertz force at the same depth, as a polynomial in χ = √(R*·d)/h.
///
/// 1 − 2α/π·χ + 4α²/π²·χ² − 8/π³·(α³ + 4π²/15·β)·χ³ + 16α/π⁴·(α³ + 3π²/5·β)·χ⁴ with
/// α = −(1.2876 − 1.4678ν + 1.3442ν²)/(1−ν), β = (0.6387 − 1.0277ν + 1.5164ν²)/(1−ν)
/// Dimitriadis et al., Biophys. J. 82 (2002) 2798, Eq. 12 and 13. The polynomial assumes a contact
/// radius of √(R*·d) and so underestimates the force (ν = 0.48) by 1 % at χ = 0.2, 7 % at 0.5 and
/// 17 % at 1. Real-time: yes.
[[nodiscard]] double dimitriadis_factor(double chi, double poisson_ratio) noexcept MERKEL_REALTIME;

/// The closed form that a skin selects for a sphere: Hertz on a half-space, Sneddon's exact sphere,
/// or the polynomial of a layer on bone. Real-time: yes, after construction.
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
  /// The contact with the moduli of undeformed skin.
  [[nodiscard]] ContactState elastic_at_depth(double depth_mm) const noexcept;

  HertzContact hertz_;
  std::optional<SneddonContact> sneddon_;
  SkinParameters skin_;
};

}  // namespace merkel
