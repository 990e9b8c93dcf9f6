#include "core/scene/drive_reach.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>

#include "core/contact/far_field.hpp"
#include "core/contact/huber_stress.hpp"
#include "core/contact/placed_contact.hpp"
#include "core/skin/strain_energy_density.hpp"

namespace merkel {
namespace {

constexpr double kDeepest_mm = 10.0;
constexpr int kDepths = 200;
constexpr double kFarthest_mm = 200.0;
constexpr double kSpacing_mm = 0.05;  ///< between sampled distances
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

/// For each of a tip's tables, the largest energy density that it has per depth² in skin at rest at
/// kSpacing_mm·k or farther; beyond the last, the tip is a point load.
std::vector<std::vector<double>> largest_energies(const TipField& tip, const SkinParameters& skin) {
  const SkinMaterial material(skin);
  const PixelGrid& grid = tip.tables().grid;
  std::vector<std::vector<double>> largest;
  for (const PressTables::Table& table : tip.tables().tables) {
    std::vector<double>& energies = largest.emplace_back();
    for (std::size_t i = 0; i < table.nodes.size(); ++i) {
      // A node acts as far as its neighbours.
      const double r = std::hypot(grid.x_mm(i % grid.columns), grid.y_mm(i / grid.columns));
      const auto bin = static_cast<std::size_t>((r + grid.pixel_mm) / kSpacing_mm);
      if (bin >= energies.size()) energies.resize(bin + 1);
      energies[bin] = std::max(energies[bin], energy_density_kPa(table.nodes[i].stress(), material,
                                                                 skin.energy_density));
    }
    for (std::size_t k = energies.size() - 1; k-- > 0;) {
      energies[k] = std::max(energies[k], energies[k + 1]);
    }
  }
  return largest;
}

/// The distance from a tip beyond which a press stays below a limit. √SED is a norm, so that a
/// blend of two tables stays below the larger one, times the weights' sum.
double radius_of_field(const PlacedContact& placed,
                       const std::vector<std::vector<double>>& largest_kPa, const FarEnergy& far,
                       double limit_kPa) {
  const TipField& tip = *placed.field;
  const TipField::Blend blend = tip.blend(placed.contact.depth_mm);
  const double weights = std::fabs(blend.weight[0]) + std::fabs(blend.weight[1]);
  const double per_depth2 = limit_kPa / placed.stored_energy(weights * weights);
  const PixelGrid& grid = tip.tables().grid;
  const double inside_mm =
      0.5 * grid.pixel_mm * static_cast<double>(std::min(grid.columns, grid.rows) - 3);
  double radius_mm = 0.0;
  for (std::size_t t = 0; t < 2; ++t) {
    if (blend.weight[t] == 0.0) continue;
    const std::vector<double>& energies = largest_kPa[blend.lower + t];
    const auto beyond = std::partition_point(energies.begin(), energies.end(),
                                             [&](double energy) { return energy > per_depth2; });
    radius_mm = std::max(radius_mm, kSpacing_mm * static_cast<double>(beyond - energies.begin()));
    const double force = tip.tables().tables[blend.lower + t].force_mN_per_mm;
    const double load_mm = force > 0.0 ? far.reach_mm(per_depth2 / (force * force)) : 0.0;
    if (load_mm > inside_mm) radius_mm = std::max(radius_mm, load_mm);
  }
  return radius_mm;
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
  std::vector<std::vector<double>> largest_kPa;
  std::optional<FarEnergy> far;
  if (tip.field() != nullptr) {
    largest_kPa = largest_energies(*tip.field(), skin);
    far.emplace(FarField(LayeredMedium(skin), skin), skin);
  }
  radius_mm_.reserve(kDepths + 1);
  for (int k = 0; k <= kDepths; ++k) {
    const double depth_mm = k * spacing_mm_;
    const PlacedContact placed{.contact = tip.press_at_depth({}, depth_mm).contact,
                               .field = tip.field()};
    const double radius_mm = tip.field() != nullptr
                                 ? radius_of_field(placed, largest_kPa, *far, limit_kPa)
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
