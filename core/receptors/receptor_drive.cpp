#include "core/receptors/receptor_drive.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/contact/hertz_contact.hpp"
#include "core/units.hpp"

namespace merkel {
namespace {

double square(double x) { return x * x; }

std::variant<ReceptorArrays<double>, ReceptorArrays<float>> make_arrays(
    std::span<const Receptor> receptors, const ReceptorDrive::Parameters& p) {
  if (p.precision == Precision::kFloat) {
    return ReceptorArrays<float>(receptors, p.skin, p.transduction);
  }
  return ReceptorArrays<double>(receptors, p.skin, p.transduction);
}

std::vector<Receptor> by_neuron(std::span<const Receptor> receptors) {
  std::vector<Receptor> sorted(receptors.begin(), receptors.end());
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Receptor& a, const Receptor& b) { return a.neuron < b.neuron; });
  return sorted;
}

}  // namespace

double ReceptorDrive::Box::nearest2(double x, double y) const noexcept {
  return square(std::max({left - x, x - right, 0.0})) +
         square(std::max({bottom - y, y - top, 0.0}));
}

double ReceptorDrive::Box::farthest2(double x, double y) const noexcept {
  return square(std::max(x - left, right - x)) + square(std::max(y - bottom, top - y));
}

ReceptorDrive::ReceptorDrive(std::span<const Receptor> receptors, std::size_t neurons,
                             const Parameters& parameters)
    : parameters_(parameters),
      receptors_(by_neuron(receptors)),
      first_of_neuron_(neurons + 1),
      arrays_(make_arrays(receptors_, parameters)),
      resting_current_(parameters.transduction.current_uA_per_cm2(0.0)),
      output_(neurons) {
  alone_.known.resize(receptors_.size());
  alone_.per_mm.resize(receptors_.size());
  contacts_.reserve(parameters.most_contacts);
  ranges_.reserve(parameters.most_contacts);
  pressed_.reserve(neurons);
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  constexpr Box kNothing{kInfinite, -kInfinite, kInfinite, -kInfinite};
  const auto include = [](Box& box, const Receptor& receptor) {
    box.left = std::min(box.left, receptor.x_mm);
    box.right = std::max(box.right, receptor.x_mm);
    box.bottom = std::min(box.bottom, receptor.y_mm);
    box.top = std::max(box.top, receptor.y_mm);
  };
  box_ = kNothing;
  box_of_neuron_.assign(neurons, kNothing);
  for (const Receptor& receptor : receptors_) {
    assert(receptor.neuron >= 1 && receptor.neuron <= neurons);
    ++first_of_neuron_[receptor.neuron];
    include(box_of_neuron_[receptor.neuron - 1], receptor);
    include(box_, receptor);
  }
  for (std::size_t n = 1; n <= neurons; ++n) first_of_neuron_[n] += first_of_neuron_[n - 1];
}

double ReceptorDrive::energy_density_kPa(std::size_t receptor) const noexcept {
  return std::visit([=](const auto& arrays) { return arrays.energy_density_kPa(receptor); },
                    arrays_);
}

void ReceptorDrive::find_ranges(std::span<const PlacedContact> contacts) noexcept {
  ranges_.clear();
  all_displaced_ = false;
  const double threshold_mm = units::mm_from_um(parameters_.transduction.threshold_um);
  const double share_mm = threshold_mm / static_cast<double>(contacts.size());
  for (const PlacedContact& placed : contacts) {
    const double farthest2 = box_.farthest2(placed.x_mm, placed.y_mm);
    Ranges ranges{.reach2 = square(placed.reach_mm), .displaced2 = 0.0, .may_displace2 = 0.0};
    if (placed.taxels != nullptr) {
      ranges_.push_back(ranges);  // no threshold: only the mean energy density is computed
      continue;
    }
    if (placed.sliding != nullptr) {
      ranges.may_displace2 = std::numeric_limits<double>::infinity();
    } else if (placed.field != nullptr) {
      if (!placed.field->on_half_space()) {
        // Layers may bulge: ask each receptor.
        ranges.may_displace2 = std::numeric_limits<double>::infinity();
        ranges_.push_back(ranges);
        continue;
      }
      // The whole force acts within half a diagonal of the axis, so U lies between its values for
      // a point load at the near and at the far side.
      const double half_diagonal = placed.field->half_diagonal_mm();
      const double at_1_mm = placed.field->far_displacement_mm2(placed.contact.depth_mm);
      ranges.displaced2 = square(std::max(0.0, at_1_mm / threshold_mm - half_diagonal));
      ranges.may_displace2 = square(at_1_mm / share_mm + half_diagonal);
    } else if (HertzContact::surface_displacement_mm(placed.contact, std::sqrt(farthest2)) >=
               threshold_mm) {
      ranges.displaced2 = ranges.may_displace2 = std::numeric_limits<double>::infinity();
    } else {
      ranges.displaced2 =
          square(HertzContact::radius_of_displacement_mm(placed.contact, threshold_mm));
      ranges.may_displace2 =
          contacts.size() == 1
              ? ranges.displaced2
              : square(HertzContact::radius_of_displacement_mm(placed.contact, share_mm) + 1e-6);
    }
    all_displaced_ = all_displaced_ || farthest2 <= ranges.displaced2;
    ranges_.push_back(ranges);
  }
}

bool ReceptorDrive::reaches(const Box& box) const noexcept {
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    const PlacedContact& placed = contacts_[i];
    if (box.nearest2(placed.x_mm, placed.y_mm) > ranges_[i].reach2) continue;
    if (placed.mask == nullptr ||
        placed.mask->reaches(placed.contact.depth_mm, box.left - placed.x_mm,
                             box.right - placed.x_mm, box.bottom - placed.y_mm,
                             box.top - placed.y_mm)) {
      return true;
    }
  }
  return false;
}

ReceptorDrive::Displaced ReceptorDrive::displaced(const Box& box) const noexcept {
  if (all_displaced_) return Displaced::kAll;
  Displaced found = Displaced::kNone;
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    const double x = contacts_[i].x_mm;
    const double y = contacts_[i].y_mm;
    if (box.farthest2(x, y) <= ranges_[i].displaced2) return Displaced::kAll;
    if (box.nearest2(x, y) <= ranges_[i].may_displace2) found = Displaced::kSome;
  }
  return found;
}

void ReceptorDrive::Remembered::begin(const PlacedContact& placed) noexcept {
  blend = placed.field->blend(placed.contact.depth_mm);
  if (placed.field == field && placed.x_mm == x_mm && placed.y_mm == y_mm && blend.lower == lower) {
    return;
  }
  field = placed.field;
  x_mm = placed.x_mm;
  y_mm = placed.y_mm;
  lower = blend.lower;
  std::fill(known.begin(), known.end(), std::uint8_t{0});
}

double ReceptorDrive::Remembered::displacement_mm(std::size_t receptor, double dx_mm,
                                                  double dy_mm) noexcept {
  if (known[receptor] == 0) {
    known[receptor] = 1;
    per_mm[receptor] = field->displacements(lower, dx_mm, dy_mm);
  }
  return blend.weight[0] * per_mm[receptor][0] + blend.weight[1] * per_mm[receptor][1];
}

/// Whether all contacts together displace the surface above a receptor by the threshold.
bool ReceptorDrive::displaced(std::size_t receptor) noexcept {
  const double x = receptors_[receptor].x_mm;
  const double y = receptors_[receptor].y_mm;
  double sum_mm = 0.0;
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    const double dx = x - contacts_[i].x_mm;
    const double dy = y - contacts_[i].y_mm;
    const double r2 = dx * dx + dy * dy;
    if (r2 <= ranges_[i].displaced2) return true;
    if (contacts_[i].sliding != nullptr) {
      sum_mm += contacts_[i].sliding->at(dx, dy).displacement;
      continue;
    }
    if (contacts_.size() == 1 && contacts_[i].field == nullptr) return false;
    if (contacts_[i].field == nullptr) {
      sum_mm += HertzContact::surface_displacement_mm(contacts_[i].contact, std::sqrt(r2));
    } else if (contacts_.size() == 1) {
      sum_mm += alone_.displacement_mm(receptor, dx, dy);
    } else {
      sum_mm += contacts_[i].field->at(dx, dy, contacts_[i].contact.depth_mm).displacement;
    }
  }
  return sum_mm >= units::mm_from_um(parameters_.transduction.threshold_um);
}

void ReceptorDrive::rest_unreached(std::size_t neuron) noexcept {
  const std::size_t first = first_of_neuron_[neuron];
  const std::size_t last = first_of_neuron_[neuron + 1];
  std::size_t count = 0;
  switch (displaced(box_of_neuron_[neuron])) {
    case Displaced::kAll:
      count = last - first;
      break;
    case Displaced::kSome:
      for (std::size_t i = first; i < last; ++i) count += displaced(i) ? 1 : 0;
      break;
    case Displaced::kNone:
      break;
  }
  output_[neuron] = static_cast<double>(count) * resting_current_;
}

/// Drives the afferents [first_neuron, last_neuron), whose receptors are adjacent in memory.
template <class Arrays>
void ReceptorDrive::drive_reached(Arrays& arrays, std::size_t first_neuron,
                                  std::size_t last_neuron) noexcept {
  const std::size_t begin = first_of_neuron_[first_neuron];
  const std::size_t end = first_of_neuron_[last_neuron];
  if (begin == end) return;
  arrays.press(contacts_, begin, end);
  pressed_.push_back({.first = begin, .last = end});
  arrays.transduce(begin, end);
  for (std::size_t n = first_neuron; n < last_neuron; ++n) {
    const std::size_t first = first_of_neuron_[n];
    const std::size_t last = first_of_neuron_[n + 1];
    const Displaced above = displaced(box_of_neuron_[n]);
    if (above != Displaced::kAll) {
      for (std::size_t i = first; i < last; ++i) {
        if (above == Displaced::kNone || !displaced(i)) arrays.silence(i);
      }
    }
    output_[n] = arrays.sum_of_currents(first, last);
  }
}

/// The same for the mean energy densities.
template <class Arrays>
void ReceptorDrive::average_reached(Arrays& arrays, std::size_t first_neuron,
                                    std::size_t last_neuron) noexcept {
  const std::size_t begin = first_of_neuron_[first_neuron];
  const std::size_t end = first_of_neuron_[last_neuron];
  if (begin == end) return;
  arrays.press(contacts_, begin, end);
  for (std::size_t n = first_neuron; n < last_neuron; ++n) {
    const std::size_t first = first_of_neuron_[n];
    const std::size_t last = first_of_neuron_[n + 1];
    if (first == last) continue;
    output_[n] = arrays.sum_of_energy_densities(first, last) / static_cast<double>(last - first);
  }
}

bool ReceptorDrive::compute(std::span<const PlacedContact> contacts) noexcept {
  assert(contacts.size() <= parameters_.most_contacts);
  if (std::equal(contacts.begin(), contacts.end(), contacts_.begin(), contacts_.end())) {
    return false;
  }
  contacts_.assign(contacts.begin(), contacts.end());
  reached_ = 0;
  std::visit(
      [this](auto& arrays) {
        for (const Pressed& run : pressed_) arrays.clear_energy(run.first, run.last);
      },
      arrays_);
  pressed_.clear();
  if (contacts_.empty()) {
    std::fill(output_.begin(), output_.end(), 0.0);
    return true;
  }
  const bool average = parameters_.output == Output::kMeanEnergy;
  find_ranges(contacts_);
  if (contacts_.size() == 1 && contacts_.front().field != nullptr) alone_.begin(contacts_.front());
  std::size_t started = 0;
  for (std::size_t n = 0; n <= output_.size(); ++n) {
    if (n < output_.size() && reaches(box_of_neuron_[n])) continue;
    if (started < n) {
      std::visit(
          [&](auto& arrays) {
            average ? average_reached(arrays, started, n) : drive_reached(arrays, started, n);
          },
          arrays_);
      reached_ += n - started;
    }
    if (n < output_.size()) {
      if (average) {
        output_[n] = 0.0;
      } else {
        rest_unreached(n);
      }
    }
    started = n + 1;
  }
  return true;
}

}  // namespace merkel
