#pragma once

#include <vector>

#include "core/contact/tip_contact.hpp"
#include "core/realtime_tag.hpp"
#include "core/receptors/sigmoid_transduction.hpp"
#include "core/skin/skin_material.hpp"

namespace merkel {

/// How far from a tip's axis its press can move a receptor's current by more than a tolerance.
///
/// Beyond the reach, the current lies between σ(0) and σ(0) + tolerance·α, σ the sigmoid of Eq. 7:
/// it is taken as σ(0). √SED is a norm of the stress, so where `tips` of them press at once, each
/// may add 1/tips of the norm that the tolerance allows.
/// Real-time: yes, after construction.
class DriveReach {
 public:
  /// \param tolerance  of a receptor's current, as a fraction of α; 0: no end to the reach
  DriveReach(const TipContact& tip, const SkinParameters& skin,
             const SigmoidTransduction& transduction, double tolerance, std::size_t tips);

  /// The reach of an energy density: where one tip alone makes no more than a limit, kPa; infinite
  /// where the limit is 0. Several tips share it as above.
  DriveReach(const TipContact& tip, const SkinParameters& skin, double limit_kPa, std::size_t tips);

  /// At an indentation depth; infinite where the table ends. Never falls with the depth.
  [[nodiscard]] double radius_mm(double depth_mm) const noexcept MERKEL_REALTIME;

  /// The energy density that moves the current by the tolerance, kPa.
  [[nodiscard]] static double energy_of_tolerance_kPa(const SigmoidTransduction& transduction,
                                                      double tolerance) noexcept;

 private:
  double spacing_mm_;
  std::vector<double> radius_mm_;  ///< at depths 0, spacing, 2·spacing …
};

}  // namespace merkel
