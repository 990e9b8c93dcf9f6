#include "core/contact/tip_field.hpp"

#include <algorithm>
#include <cmath>
#include <list>
#include <mutex>
#include <numbers>
#include <utility>

#include "core/contact/pressed_tip.hpp"
#include "core/math/bisection.hpp"
#include "core/math/cubic_interpolation.hpp"
#include "core/skin/strain_energy_density.hpp"

namespace merkel {
namespace {

PressedTip at_one_depth(PressedTip tip, double depth_mm) {
  tip.deepest_mm = depth_mm;
  tip.proportional = true;
  return tip;
}

/// The fields of past and present models.
class FieldStore {
 public:
  FieldStore() = default;
  /// With the fields that another one keeps, unless a thread is using that one.
  FieldStore(FieldStore& other) {
    const std::unique_lock lock(other.entries_mutex_, std::try_to_lock);
    if (!lock) return;
    for (const auto& each : other.entries_) {
      if (!each->kept) continue;
      entries_.push_back(std::make_shared<Entry>(each->indenter, each->skin));
      entries_.back()->known = entries_.back()->kept = each->kept;
    }
  }

  std::shared_ptr<const TipField> field_of(const Indenter& indenter, SkinParameters skin) {
    skin.apex.reset();  // fields count from the tip's axis
    const std::shared_ptr<Entry> entry = entry_of(indenter, skin);
    std::shared_ptr<const TipField> field;
    {
      // Whoever needs the same field at the same time waits for it.
      const std::scoped_lock solving(entry->solving);
      field = entry->known.lock();
      if (!field) entry->known = field = std::make_shared<const TipField>(indenter, skin);
    }
    keep(*entry, field);
    return field;
  }

 private:
  static constexpr std::size_t kMaxBytes = std::size_t{1} << 30U;

  struct Entry {
    Entry(const Indenter& of, const SkinParameters& in) : indenter(of), skin(in) {}
    Indenter indenter;
    SkinParameters skin;
    std::mutex solving;
    std::weak_ptr<const TipField> known;
    std::shared_ptr<const TipField> kept;
  };

  std::shared_ptr<Entry> entry_of(const Indenter& indenter, const SkinParameters& skin) {
    const std::scoped_lock lock(entries_mutex_);
    auto found = std::find_if(entries_.begin(), entries_.end(), [&](const auto& entry) {
      return indenter.same_tip(entry->indenter) && skin == entry->skin;
    });
    if (found == entries_.end()) {
      entries_.push_back(std::make_shared<Entry>(indenter, skin));
      found = std::prev(entries_.end());
    }
    entries_.splice(entries_.begin(), entries_, found);  // the latest first
    return entries_.front();
  }

  void keep(Entry& entry, const std::shared_ptr<const TipField>& field) {
    const std::scoped_lock lock(entries_mutex_);
    entry.kept = field;
    std::size_t bytes = 0;
    for (const auto& each : entries_) {
      if (!each->kept) continue;
      bytes += each->kept->bytes();
      if (bytes > kMaxBytes) each->kept.reset();
    }
    std::erase_if(entries_,
                  [](const auto& each) { return each.use_count() == 1 && each->known.expired(); });
  }

  std::mutex entries_mutex_;
  std::list<std::shared_ptr<Entry>> entries_;
};

/// Never destroyed: threads may still make models while the process ends.
FieldStore*& store_of_process() {
  static auto* store = new FieldStore;
  return store;
}

}  // namespace

std::shared_ptr<const TipField> TipField::shared(const Indenter& indenter,
                                                 const SkinParameters& skin) {
  return store_of_process()->field_of(indenter, skin);
}

void TipField::shared_after_fork() { store_of_process() = new FieldStore(*store_of_process()); }

std::size_t TipField::bytes() const noexcept {
  return press_.tables.size() * press_.grid.pixels() * (sizeof(GridNode) + sizeof(EnergyNode));
}

TipField::TipField(const Indenter& indenter, const SkinParameters& skin)
    : TipField(pressed_tip(indenter, skin), LayeredMedium(skin), skin) {}

TipField::TipField(const Indenter& indenter, const SkinParameters& skin, double depth_mm)
    : TipField(pressed_tip(indenter, skin), skin, depth_mm) {}

TipField::TipField(PressedTip tip, const SkinParameters& skin, double depth_mm)
    : TipField(at_one_depth(std::move(tip), depth_mm), LayeredMedium(skin), skin) {}

TipField::TipField(const PressedTip& tip, const LayeredMedium& medium, const SkinParameters& skin)
    : skin_(skin),
      kind_(skin.energy_density),
      far_(medium, skin),
      half_diagonal_mm_(std::hypot(tip.half_width_mm, tip.half_length_mm)),
      proportional_(tip.proportional),
      press_(press_tables(tip, medium, skin.receptor_depth_mm)) {
  fill_energies();
}

std::vector<double> TipField::node_energies_kPa(std::size_t table) const {
  const std::vector<GridNode>& nodes = press_.tables[table].nodes;
  std::vector<double> energies(nodes.size());
  std::transform(nodes.begin(), nodes.end(), energies.begin(), [&](const GridNode& node) {
    return energy_density_kPa(node.stress(), skin_, kind_);
  });
  return energies;
}

void TipField::fill_energies() {
  std::vector<double> lower = node_energies_kPa(0);
  for (std::size_t k = 0; k + 1 < press_.tables.size(); ++k) {
    const auto& below = press_.tables[k].nodes;
    const auto& above = press_.tables[k + 1].nodes;
    std::vector<double> upper = node_energies_kPa(k + 1);
    std::vector<EnergyNode>& nodes = energies_.emplace_back(below.size());
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      CartesianStress sum = below[i].stress();
      sum += above[i].stress();
      nodes[i].values[0] = static_cast<float>(lower[i]);
      nodes[i].values[1] =
          static_cast<float>(energy_density_kPa(sum, skin_, kind_) - lower[i] - upper[i]);
      nodes[i].values[2] = static_cast<float>(upper[i]);
    }
    lower = std::move(upper);
  }
}

TipField::Blend TipField::blend(double depth_mm) const noexcept {
  const double depth = std::max(0.0, depth_mm);
  const std::size_t last = press_.tables.size() - 1;
  const double deepest = press_.tables[last].depth_mm;
  if (proportional_ || depth >= deepest) {
    const double before = press_.tables[last - 1].depth_mm;
    const double beyond = (depth - deepest) / (deepest - before);
    return {last - 1, {-beyond * before, deepest + beyond * deepest}};
  }
  const auto above = std::upper_bound(
      press_.tables.begin() + 1, press_.tables.end(), depth,
      [](double value, const PressTables::Table& table) { return value < table.depth_mm; });
  const double lower = std::sqrt((above - 1)->depth_mm);
  const double part = (std::sqrt(depth) - lower) / (std::sqrt(above->depth_mm) - lower);
  return {static_cast<std::size_t>(above - press_.tables.begin()) - 1,
          {(1.0 - part) * depth, part * depth}};
}

double TipField::force_mN(double depth_mm) const noexcept {
  const Blend at = blend(depth_mm);
  return at.weight[0] * press_.tables[at.lower].force_mN_per_mm +
         at.weight[1] * press_.tables[at.lower + 1].force_mN_per_mm;
}

double TipField::mean_pressure_kPa(double depth_mm) const noexcept {
  if (!(depth_mm > 0.0)) return 0.0;
  // The width of a smooth contact grows with √d, that of a whole flat tip stays the same.
  const Blend at = blend(depth_mm);
  const PressTables::Table& lower = press_.tables[at.lower];
  const PressTables::Table& upper = press_.tables[at.lower + 1];
  const double part = proportional_ ? 1.0
                                    : (std::sqrt(depth_mm) - std::sqrt(lower.depth_mm)) /
                                          (std::sqrt(upper.depth_mm) - std::sqrt(lower.depth_mm));
  const double width =
      std::sqrt(lower.area_mm2) + part * (std::sqrt(upper.area_mm2) - std::sqrt(lower.area_mm2));
  return force_mN(depth_mm) / (width * width);
}

double TipField::depth_mm(double force_mN_wanted) const noexcept {
  if (!(force_mN_wanted > 0.0)) return 0.0;
  double low = 0.0;
  double high = press_.tables.back().depth_mm;
  for (int doubling = 0; doubling < 60 && force_mN(high) < force_mN_wanted; ++doubling) {
    low = high;
    high *= 2.0;
  }
  return bisected(low, high, [&](double depth) { return force_mN(depth) < force_mN_wanted; });
}

double TipField::far_displacement_mm2(double depth_mm) const noexcept {
  return force_mN(depth_mm) / (std::numbers::pi * far_.surface_modulus_kPa());
}

double TipField::largest_energy_kPa(double depth_mm) const noexcept {
  const Blend at = blend(depth_mm);
  double largest = 0.0;
  for (const EnergyNode& node : energies_[at.lower]) {
    largest =
        std::max(largest, at.weight[0] * at.weight[0] * static_cast<double>(node.values[0]) +
                              at.weight[0] * at.weight[1] * static_cast<double>(node.values[1]) +
                              at.weight[1] * at.weight[1] * static_cast<double>(node.values[2]));
  }
  return largest;
}

double TipField::farthest_mm() const noexcept {
  const PixelGrid& grid = press_.grid;
  return 0.5 * grid.pixel_mm *
         std::hypot(static_cast<double>(grid.columns), static_cast<double>(grid.rows));
}

TipField::Place TipField::place(double x_mm, double y_mm) const noexcept {
  const PixelGrid& grid = press_.grid;
  const double column = x_mm / grid.pixel_mm + 0.5 * static_cast<double>(grid.columns - 1);
  const double row = y_mm / grid.pixel_mm + 0.5 * static_cast<double>(grid.rows - 1);
  return {column, row,
          column >= 1.0 && column < static_cast<double>(grid.columns - 2) && row >= 1.0 &&
              row < static_cast<double>(grid.rows - 2)};
}

std::optional<std::size_t> TipField::place(double x_mm, double y_mm,
                                           GridPatch& patch) const noexcept {
  const Place at = place(x_mm, y_mm);
  if (!at.inside) return std::nullopt;
  const auto i = static_cast<std::size_t>(at.column);
  const auto j = static_cast<std::size_t>(at.row);
  patch.columns = press_.grid.columns;
  patch.along_x = cubic_weights(at.column - static_cast<double>(i));
  patch.along_y = cubic_weights(at.row - static_cast<double>(j));
  return (j - 1) * patch.columns + (i - 1);
}

SkinField TipField::at(double x_mm, double y_mm, double depth_mm) const noexcept {
  GridPatch patch;
  const auto corner = place(x_mm, y_mm, patch);
  if (!corner) return far_.at(force_mN(depth_mm), x_mm, y_mm);
  const Blend blended = blend(depth_mm);
  for (std::size_t t = 0; t < 2; ++t) {
    if (blended.weight[t] == 0.0) continue;
    patch.corner[t] = press_.tables[blended.lower + t].nodes.data() + *corner;
    patch.weight[t] = blended.weight[t];
  }
  const GridNode total = interpolate(patch);
  return {.stress = total.stress(), .displacement = static_cast<double>(total.values[6])};
}

void TipField::energies(std::size_t lower, std::span<const double> x_mm,
                        std::span<const double> y_mm, std::span<Energies> found) const noexcept {
  const double below = press_.tables[lower].force_mN_per_mm;
  const double above = press_.tables[lower + 1].force_mN_per_mm;
  GridPoints points;
  std::array<bool, GridPoints::kCount> inside{};
  const std::size_t count = std::min(found.size(), GridPoints::kCount);
  for (std::size_t i = 0; i < GridPoints::kCount; ++i) {
    const Place at = i < count ? place(x_mm[i], y_mm[i]) : Place{};
    inside[i] = at.inside;
    points.column[i] = at.inside ? at.column : 1.0;
    points.row[i] = at.inside ? at.row : 1.0;
  }
  std::array<EnergyNode, GridPoints::kCount> totals;
  interpolate(energies_[lower].data(), press_.grid.columns, points, totals);
  for (std::size_t i = 0; i < count; ++i) {
    if (inside[i]) {
      const auto& values = totals[i].values;
      found[i] = {static_cast<double>(values[0]), static_cast<double>(values[1]),
                  static_cast<double>(values[2])};
      continue;
    }
    const double unit = energy_density_kPa(far_.at(1.0, x_mm[i], y_mm[i]).stress, skin_, kind_);
    found[i] = {unit * below * below, 2.0 * unit * below * above, unit * above * above};
  }
}

std::array<double, 2> TipField::displacements(std::size_t lower, double x_mm,
                                              double y_mm) const noexcept {
  std::array<double, 2> found{};
  GridPatch patch;
  const auto corner = place(x_mm, y_mm, patch);
  for (std::size_t t = 0; t < 2; ++t) {
    const PressTables::Table& table = press_.tables[lower + t];
    if (corner) {
      patch.corner[0] = table.nodes.data() + *corner;
      patch.weight[0] = 1.0;
      found[t] = static_cast<double>(interpolate(patch).values[6]);
    } else {
      found[t] = far_.at(table.force_mN_per_mm, x_mm, y_mm).displacement;
    }
  }
  return found;
}

}  // namespace merkel
