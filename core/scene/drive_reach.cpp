#include "core/scene/drive_reach.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <optional>
#include <vector>

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

/// The energy densities of a tip's tables per depth² in skin at rest; beyond the tables, the tip is
/// a point load.
class FieldReach {
 public:
  FieldReach(const TipField& tip, const SkinParameters& skin)
      : tip_(tip), grid_(tip.tables().grid), far_(FarField(LayeredMedium(skin), skin), skin) {
    for (std::size_t table = 0; table < tip.tables().tables.size(); ++table) {
      energies_kPa_.push_back(tip.node_energies_kPa(table));
    }
    const auto cells = [](std::size_t nodes) { return nodes / kNodesPerCell + 1; };
    mask_.cells = {.pixel_mm = grid_.pixel_mm * static_cast<double>(kNodesPerCell),
                   .columns = cells(grid_.columns),
                   .rows = cells(grid_.rows)};
    mask_.depth_mm.assign(mask_.cells.pixels(), static_cast<float>(kDeepest_mm));
    waiting_.resize(grid_.pixels());
    std::iota(waiting_.begin(), waiting_.end(), std::size_t{0});
  }

  /// Call for deeper and deeper presses. The largest distance so far is the one beyond which the
  /// press stays below a limit; the cells that it is the first to reach are reached by all presses
  /// deeper than `from_mm`. √SED is a norm, so that a blend of two tables stays below the larger
  /// one, times the weights' sum.
  double reached(const PlacedContact& placed, double limit_kPa, double from_mm) {
    const TipField::Blend blend = tip_.blend(placed.contact.depth_mm);
    const double weights = std::fabs(blend.weight[0]) + std::fabs(blend.weight[1]);
    const double per_depth2 = limit_kPa / placed.stored_energy(weights * weights);
    const double inside_mm =
        0.5 * grid_.pixel_mm * static_cast<double>(std::min(grid_.columns, grid_.rows) - 3);
    double radius_mm = 0.0;
    std::vector<const std::vector<double>*> tables;
    for (std::size_t t = 0; t < 2; ++t) {
      if (blend.weight[t] == 0.0) continue;
      tables.push_back(&energies_kPa_[blend.lower + t]);
      const double force = tip_.tables().tables[blend.lower + t].force_mN_per_mm;
      const double load_mm = force > 0.0 ? far_.reach_mm(per_depth2 / (force * force)) : 0.0;
      if (load_mm > inside_mm) radius_mm = std::max(radius_mm, load_mm);
    }
    std::erase_if(waiting_, [&](std::size_t i) {
      if (std::none_of(tables.begin(), tables.end(),
                       [&](const auto* energies) { return (*energies)[i] > per_depth2; })) {
        return false;
      }
      const double x = grid_.x_mm(i % grid_.columns);
      const double y = grid_.y_mm(i / grid_.columns);
      // A node acts as far as its neighbours.
      radius_mm = std::max(radius_mm, std::sqrt(x * x + y * y) + grid_.pixel_mm);
      mark(x, y, from_mm);
      return true;
    });
    return radius_mm;
  }

  [[nodiscard]] const ReachMask& mask() const noexcept { return mask_; }

 private:
  static constexpr std::size_t kNodesPerCell = 3;

  void mark(double x, double y, double from_mm) {
    const PixelGrid& cells = mask_.cells;
    const auto place = [&](double at_mm, std::size_t count) {
      const double cell = at_mm / cells.pixel_mm + 0.5 * static_cast<double>(count);
      return static_cast<std::size_t>(std::clamp(cell, 0.0, static_cast<double>(count - 1)));
    };
    for (const double dy : {-grid_.pixel_mm, grid_.pixel_mm}) {
      for (const double dx : {-grid_.pixel_mm, grid_.pixel_mm}) {
        float& from =
            mask_
                .depth_mm[place(y + dy, cells.rows) * cells.columns + place(x + dx, cells.columns)];
        from = std::min(from, static_cast<float>(from_mm));
      }
    }
  }

  const TipField& tip_;
  const PixelGrid& grid_;
  FarEnergy far_;
  std::vector<std::vector<double>> energies_kPa_;  ///< of each table, at its nodes
  std::vector<std::size_t> waiting_;               ///< nodes that no press has reached
  ReachMask mask_;
};

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
  std::optional<FieldReach> field;
  if (tip.field() != nullptr) field.emplace(*tip.field(), skin);
  radius_mm_.reserve(kDepths + 1);
  for (int k = 0; k <= kDepths; ++k) {
    const double depth_mm = k * spacing_mm_;
    const PlacedContact placed{.contact = tip.press_at_depth({}, depth_mm).contact,
                               .field = tip.field()};
    const double radius_mm = field ? field->reached(placed, limit_kPa, depth_mm - spacing_mm_)
                                   : radius_of_sphere(placed, skin, limit_kPa);
    radius_mm_.push_back(radius_mm_.empty() ? radius_mm : std::max(radius_mm, radius_mm_.back()));
  }
  if (field) mask_ = field->mask();
}

double DriveReach::radius_mm(double depth_mm) const noexcept {
  const double place = std::ceil(depth_mm / spacing_mm_);
  if (!(place < static_cast<double>(radius_mm_.size()))) return kInfinite;
  return radius_mm_[static_cast<std::size_t>(place)];
}

}  // namespace merkel
