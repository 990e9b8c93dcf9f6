#pragma once

#include <vector>

#include "core/contact/reach_mask.hpp"
#include "core/contact/tip_contact.hpp"
#include "core/realtime_tag.hpp"
#include "core/receptors/sigmoid_transduction.hpp"
#include "core/skin/skin_material.hpp"

namespace merkel {

/// The distance from a tip's axis within which its press can change a receptor's current by more
/// than a tolerance; under a solved contact, also the places around the axis.
///
/// Beyond the reach, the current lies between σ(0) and σ(0) + tolerance·α, where σ is the sigmoid
/// of Eq. 7; it is taken as σ(0). √SED is a norm of the stress, so if `tips` tips press at the same
/// time, each may add 1/tips of the norm that the tolerance allows.
/// Real-time: yes, after construction.
class DriveReach {
 public:
  /// \param tolerance  of a receptor's current, as a fraction of α; 0: unlimited reach
  DriveReach(const TipContact& tip, const SkinParameters& skin,
             const SigmoidTransduction& transduction, double tolerance, std::size_t tips);

  /// The reach of an energy density: the distance beyond which one tip alone stays below a limit
  /// in kPa; infinite if the limit is 0. As above, each of `tips` tips may add 1/tips of the norm.
  DriveReach(const TipContact& tip, const SkinParameters& skin, double limit_kPa, std::size_t tips);

  /// The reach at an indentation depth; infinite beyond the table. Never decreases with the depth.
  [[nodiscard]] double radius_mm(double depth_mm) const noexcept MERKEL_REALTIME;

  /// The places within that distance, up to the end of a tip's tables; null if all are reached.
  [[nodiscard]] const ReachMask* mask() const noexcept MERKEL_REALTIME {
    return mask_.depth_mm.empty() ? nullptr : &mask_;
  }

  /// The energy density that changes the current by the tolerance, kPa.
  [[nodiscard]] static double energy_of_tolerance_kPa(const SigmoidTransduction& transduction,
                                                      double tolerance) noexcept;

 private:
  double spacing_mm_;
  std::vector<double> radius_mm_;  ///< at depths 0, spacing, 2·spacing …
  ReachMask mask_;
};

}  // namespace merkel
