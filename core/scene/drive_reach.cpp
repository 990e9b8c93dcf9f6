#include "core/scene/drive_reach.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "core/contact/huber_stress.hpp"
#include "core/skin/strain_energy_density.hpp"

namespace merkel {
namespace {

constexpr double kDeepest_mm = 10.0;
constexpr int kDepths = 200;
constexpr double kFarthest_mm = 200.0;
constexpr double kSpacing_mm = 0.05;  ///< between sampled distances
constexpr int kDirections = 360;      ///< sampled directions around bars
constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// The smallest distance beyond which an energy density stays below a limit, searched from
/// outside.
/// \param rim_mm  beyond it, the energy density decreases monotonically
double last_above(double limit_kPa, double rim_mm,
                  const std::function<double(double)>& energy_kPa) {
  double r = std::max(rim_mm, kSpacing_mm);
  while (r < kFarthest_mm && energy_kPa(r) > limit_kPa) r *= 2.0;
  if (r >= kFarthest_mm) return kInfinite;
  r = std::min(kFarthest_mm, 2.0 * r);
  while (r > 0.0 && energy_kPa(r) <= limit_kPa) r -= kSpacing_mm;
  return std::max(r, 0.0) + kSpacing_mm;
}

}  // namespace

double DriveReach::energy_of_tolerance_kPa(const SigmoidTransduction& transduction,
                                           double tolerance) noexcept {
  // σ(SED) = σ(0) + tolerance, solved for the SED.
  const double moved = logistic(-transduction.gamma_per_kPa * transduction.lambda_kPa) + tolerance;
  if (!(moved < 1.0)) return kInfinite;
  return transduction.lambda_kPa + std::log(moved / (1.0 - moved)) / transduction.gamma_per_kPa;
}

DriveReach::DriveReach(const TipContact& tip, const SkinParameters& skin,
                       const SigmoidTransduction& transduction, double tolerance, std::size_t tips)
    : DriveReach(tip, skin,
                 tolerance > 0.0 ? energy_of_tolerance_kPa(transduction, tolerance) : 0.0, tips) {}

DriveReach::DriveReach(const TipContact& tip, const SkinParameters& skin, double limit_of_all_kPa,
                       std::size_t tips)
    : spacing_mm_(kDeepest_mm / kDepths) {
  if (!(limit_of_all_kPa > 0.0)) return;
  const double share = static_cast<double>(tips);
  const double limit_kPa = limit_of_all_kPa / (share * share);
  const SkinMaterial material(skin);
  radius_mm_.reserve(kDepths + 1);
  if (tip.sphere() != nullptr) {
    for (int k = 0; k <= kDepths; ++k) {
      const ContactState contact = tip.sphere()->at_depth(k * spacing_mm_);
      radius_mm_.push_back(last_above(limit_kPa, contact.contact_radius_mm, [&](double r) {
        const AxisymmetricStress stress =
            tip.layer() != nullptr
                ? tip.layer()->stress(contact, r)
                : huber_stress(contact, skin.poisson_ratio, r, skin.receptor_depth_mm);
        return energy_density_kPa(stress, material, skin.energy_density);
      }));
    }
  } else {
    // The energy density per depth², maximised over all directions and depths. On flat skin it is
    // the same at all depths; on a curved finger the longest contact has the maximum.
    std::vector<double> largest_kPa;
    for (double r = 0.0; r <= kFarthest_mm; r += kSpacing_mm) {
      double largest = 0.0;
      for (int k = 0; k < kDirections; ++k) {
        const double angle = 2.0 * std::numbers::pi * k / kDirections;
        const auto deepest =
            tip.flat_tip()->at(r * std::cos(angle), r * std::sin(angle), kDeepest_mm);
        largest = std::max(largest, energy_density_kPa(deepest.stress * (1.0 / kDeepest_mm),
                                                       material, skin.energy_density));
      }
      largest_kPa.push_back(largest);
    }
    for (std::size_t k = largest_kPa.size() - 1; k-- > 0;) {
      largest_kPa[k] = std::max(largest_kPa[k], largest_kPa[k + 1]);
    }
    for (int k = 0; k <= kDepths; ++k) {
      const double depth = k * spacing_mm_;
      const auto beyond = std::find_if(largest_kPa.begin(), largest_kPa.end(), [&](double energy) {
        return energy * depth * depth <= limit_kPa;
      });
      radius_mm_.push_back(beyond == largest_kPa.end()
                               ? kInfinite
                               : kSpacing_mm * static_cast<double>(beyond - largest_kPa.begin()));
    }
  }
  for (std::size_t k = 1; k < radius_mm_.size(); ++k) {
    radius_mm_[k] = std::max(radius_mm_[k], radius_mm_[k - 1]);
  }
}

double DriveReach::radius_mm(double depth_mm) const noexcept {
  const double place = std::ceil(depth_mm / spacing_mm_);
  if (!(place < static_cast<double>(radius_mm_.size()))) return kInfinite;
  return radius_mm_[static_cast<std::size_t>(place)];
}

}  // namespace merkel
