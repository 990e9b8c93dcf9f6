#include "core/scene/drive_reach.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "core/contact/huber_stress.hpp"
#include "core/contact/placed_contact.hpp"
#include "core/skin/strain_energy_density.hpp"

namespace merkel {
namespace {

constexpr double kDeepest_mm = 10.0;
constexpr int kDepths = 200;
constexpr double kFarthest_mm = 200.0;
constexpr double kSpacing_mm = 0.05;  ///< between sampled distances
constexpr int kDirections = 360;      ///< sampled directions around a tip
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

double radius_of_sphere(const PlacedContact& placed, const SkinParameters& skin, double limit_kPa) {
  const SkinMaterial material(skin);
  return last_above(limit_kPa, placed.contact.contact_radius_mm, [&](double r) {
    const AxisymmetricStress stress =
        huber_stress(placed.contact, skin.poisson_ratio, r, skin.receptor_depth_mm);
    return placed.stored_energy(energy_density_kPa(stress, material, skin.energy_density));
  });
}

/// The largest energy density per depth² that a solved contact causes in skin at rest at
/// kSpacing_mm·k or farther, in all directions and at several depths.
std::vector<double> largest_energy_per_depth2(const TipField& tip, const SkinParameters& skin) {
  const SkinMaterial material(skin);
  const double end_mm = tip.farthest_mm();
  std::vector<double> largest_kPa;
  for (double r = 0.0; r <= kFarthest_mm; r += kSpacing_mm) {
    double largest = 0.0;
    // Beyond the tables, the tip is a point load.
    const int directions = r > end_mm ? 1 : kDirections;
    for (const double depth_mm : {0.25 * tip.deepest_mm(), tip.deepest_mm(), kDeepest_mm}) {
      for (int k = 0; k < directions; ++k) {
        const double angle = 2.0 * std::numbers::pi * k / kDirections;
        const auto values = tip.at(r * std::cos(angle), r * std::sin(angle), depth_mm);
        largest = std::max(largest, energy_density_kPa(values.stress * (1.0 / depth_mm), material,
                                                       skin.energy_density));
      }
    }
    largest_kPa.push_back(largest);
  }
  for (std::size_t k = largest_kPa.size() - 1; k-- > 0;) {
    largest_kPa[k] = std::max(largest_kPa[k], largest_kPa[k + 1]);
  }
  return largest_kPa;
}

double radius_of_field(const PlacedContact& placed, const std::vector<double>& largest_kPa,
                       double limit_kPa) {
  const double depth_mm = placed.contact.depth_mm;
  const auto beyond = std::find_if(largest_kPa.begin(), largest_kPa.end(), [&](double energy) {
    return placed.stored_energy(energy * depth_mm * depth_mm) <= limit_kPa;
  });
  return beyond == largest_kPa.end()
             ? kInfinite
             : kSpacing_mm * static_cast<double>(beyond - largest_kPa.begin());
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
  const auto largest_kPa = tip.field() != nullptr ? largest_energy_per_depth2(*tip.field(), skin)
                                                  : std::vector<double>{};
  radius_mm_.reserve(kDepths + 1);
  for (int k = 0; k <= kDepths; ++k) {
    const double depth_mm = k * spacing_mm_;
    const PlacedContact placed{.contact = tip.press_at_depth({}, depth_mm).contact,
                               .field = tip.field()};
    const double radius_mm = tip.field() != nullptr
                                 ? radius_of_field(placed, largest_kPa, limit_kPa)
                                 : radius_of_sphere(placed, skin, limit_kPa);
    radius_mm_.push_back(radius_mm_.empty() ? radius_mm : std::max(radius_mm, radius_mm_.back()));
  }
}

double DriveReach::radius_mm(double depth_mm) const noexcept {
  const double place = std::ceil(depth_mm / spacing_mm_);
  if (!(place < static_cast<double>(radius_mm_.size()))) return kInfinite;
  return radius_mm_[static_cast<std::size_t>(place)];
}

}  // namespace merkel
