#include "core/scene/tactile_model.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>

#include "core/scene/model_check.hpp"
#include "core/scene/patch_layout.hpp"
#include "core/units.hpp"

namespace merkel {
namespace {

/// Largest number of spikes of a neuron per tick: it is refractory for at least a millisecond after
/// a spike.
std::size_t most_spikes(const TactileModel::Parameters& p) {
  const double interval_ms = std::visit(
      [](const auto& afferent) { return std::min(1.0, afferent.shortest_interval_ms()); },
      p.afferent);
  return 2 + static_cast<std::size_t>(units::ms_from(p.tick) / interval_ms);
}

std::size_t indenters_on(std::size_t patch, const TactileModel::Parameters& p) {
  return static_cast<std::size_t>(
      std::count_if(p.indenters.begin(), p.indenters.end(),
                    [patch](const Indenter& indenter) { return indenter.patch == patch; }));
}

std::unique_ptr<SlidingContact> sliding_of(const Indenter& indenter,
                                           const TactileModel::Parameters& p) {
  if (!indenter.surface.slides) return nullptr;
  const double tolerance = p.accuracy.cull_tolerance;
  const double limit_kPa = p.energy_driven() || tolerance == 0.0
                               ? tolerance
                               : DriveReach::energy_of_tolerance_kPa(p.transduction, tolerance);
  return std::make_unique<SlidingContact>(indenter, p.skin, p.tick, limit_kPa);
}

/// Limits the memory of all patches of a model, before any of it is used.
Expected<void, ParameterError> check_size(const TactileModel::Parameters& p) {
  constexpr double kMaxSpikesPerTick = 1e7;
  PatchSize all;
  ParameterCheck check;
  for (const PatchParameters& patch : p.patches) {
    const auto size = size_of(patch);
    if (!size) return Unexpected<ParameterError>(size.error());
    all.receptors += size->receptors;
    all.afferents += size->afferents;
    check.require(all.receptors <= static_cast<double>(kMaxReceptors), size->key,
                  "gives more receptors in all patches than a scene can hold (10000000)");
  }
  return check
      .require(all.afferents * static_cast<double>(most_spikes(p)) <= kMaxSpikesPerTick,
               "loop.tick_us",
               "is so long that the afferents could fire more than 10000000 spikes in a tick: "
               "make it shorter")
      .result();
}

Expected<std::vector<PatchLayout>, ParameterError> layouts_of(const TactileModel::Parameters& p) {
  if (auto checked = check_size(p); !checked) return Unexpected<ParameterError>(checked.error());
  std::vector<PatchLayout> layouts;
  for (const PatchParameters& patch : p.patches) {
    auto layout = layout_of(patch);
    if (!layout) return Unexpected<ParameterError>(layout.error());
    layouts.push_back(std::move(*layout));
  }
  return layouts;
}

Expected<TactilePatch, ParameterError> make_patch(const TactileModel::Parameters& p,
                                                  std::size_t index, const PatchLayout& layout,
                                                  const AfferentTables& tables,
                                                  std::uint32_t first_neuron) {
  const std::size_t neurons = layout.afferents.size();
  auto afferents = Afferents::create(p, index, neurons, tables, first_neuron);
  if (!afferents) return Unexpected<ParameterError>(afferents.error());
  return TactilePatch(layout,
                      {.skin = p.skin,
                       .transduction = p.transduction,
                       .precision = p.precision(),
                       .most_contacts = indenters_on(index, p),
                       .output = p.energy_driven() ? ReceptorDrive::Output::kMeanEnergy
                                                   : ReceptorDrive::Output::kCurrent},
                      std::move(*afferents), neurons * most_spikes(p));
}

std::vector<Position> positions_of(const TactilePatch& patch) {
  std::vector<Position> positions;
  for (const Receptor& receptor : patch.drive().receptors()) {
    positions.push_back({.x_mm = receptor.x_mm, .y_mm = receptor.y_mm});
  }
  return positions;
}

Expected<void, ParameterError> check_arrays(const TactileModel::Parameters& p,
                                            const std::vector<TactilePatch>& patches) {
  ParameterCheck all;
  for (const Indenter& indenter : p.indenters) {
    if (indenter.taxels() == nullptr) continue;
    const std::size_t nodes = TaxelField::nodes(*indenter.taxels(), indenter.orientation_deg,
                                                p.skin, positions_of(patches[indenter.patch]));
    all.require(nodes <= TaxelField::kMaxNodes, "skin.receptor_depth_mm",
                "is so small for an array of this size that a tick would take too long: use fewer "
                "taxels, a smaller patch or deeper receptors");
  }
  return all.result();
}

}  // namespace

Expected<TactileModel, ParameterError> TactileModel::create(const Parameters& parameters) {
  if (const auto checked = check(parameters); !checked) {
    return Unexpected<ParameterError>(checked.error());
  }
  const auto layouts = layouts_of(parameters);
  if (!layouts) return Unexpected<ParameterError>(layouts.error());
  const AfferentTables tables = afferent_tables_of(parameters);
  std::vector<TactilePatch> patches;
  std::uint32_t first_neuron = 1;
  for (std::size_t i = 0; i < parameters.patches.size(); ++i) {
    auto patch = make_patch(parameters, i, (*layouts)[i], tables, first_neuron);
    if (!patch) return Unexpected<ParameterError>(patch.error());
    first_neuron += static_cast<std::uint32_t>(patch->neurons());
    patches.push_back(std::move(*patch));
  }
  if (const auto checked = check_arrays(parameters, patches); !checked) {
    return Unexpected<ParameterError>(checked.error());
  }
  return TactileModel(parameters, std::move(patches));
}

TactileModel::TactileModel(const Parameters& parameters, std::vector<TactilePatch> patches)
    : parameters_(parameters),
      steps_(static_cast<int>(parameters.tick / parameters.step)),
      patches_(std::move(patches)),
      touching_(patches_.size()),
      next_part_(std::make_unique<std::atomic<std::size_t>>(0)),
      spikes_(neurons() * most_spikes(parameters)),
      resets_(neurons()) {
  for (const Indenter& indenter : parameters.indenters) {
    // Equal tips share their reach if as many press on the patch.
    const auto own = parameters.indenters.begin() + static_cast<std::ptrdiff_t>(tips_.size());
    const auto same = std::find_if(parameters.indenters.begin(), own,
                                   [&](const Indenter& other) { return indenter.same_tip(other); });
    const auto index = static_cast<std::size_t>(same - parameters.indenters.begin());
    tips_.emplace_back(indenter, parameters.skin);
    taxels_.push_back(nullptr);
    sliding_.push_back(sliding_of(indenter, parameters));
    const std::size_t tips = indenters_on(indenter.patch, parameters);
    if (indenter.taxels() != nullptr) {
      taxels_.back() =
          std::make_unique<TaxelField>(*indenter.taxels(), indenter.orientation_deg,
                                       parameters.skin, positions_of(patches_[indenter.patch]));
      reach_of_tip_.emplace_back(tips_.back(), parameters.skin, 0.0, std::size_t{1});  // all
    } else if (same != own && tips == indenters_on(same->patch, parameters)) {
      reach_of_tip_.push_back(reach_of_tip_[index]);
    } else if (parameters.energy_driven()) {
      reach_of_tip_.emplace_back(tips_.back(), parameters.skin, parameters.accuracy.cull_tolerance,
                                 tips);
    } else {
      reach_of_tip_.emplace_back(tips_.back(), parameters.skin, parameters.transduction,
                                 parameters.accuracy.cull_tolerance, tips);
    }
  }
  for (auto& touching : touching_) touching.reserve(tips_.size());
  deepest_.resize(tips_.size());
  presses_.resize(tips_.size());
  neighbours_.reserve(tips_.size());
}

void TactileModel::reset() noexcept {
  for (TactilePatch& patch : patches_) patch.reset();
  for (const auto& sliding : sliding_) {
    if (sliding) sliding->reset();
  }
  std::fill(presses_.begin(), presses_.end(), Press{});
  std::fill(deepest_.begin(), deepest_.end(), Press{});
  for (const auto& taxels : taxels_) {
    if (taxels) taxels->release();
  }
  closest_rims_ = std::numeric_limits<double>::infinity();
}

std::size_t TactileModel::neurons() const noexcept {
  return std::accumulate(
      patches_.begin(), patches_.end(), std::size_t{0},
      [](std::size_t sum, const TactilePatch& patch) { return sum + patch.neurons(); });
}

NeuronSample TactileModel::neuron(std::uint32_t number) const noexcept {
  std::size_t index = number - 1;
  for (const TactilePatch& patch : patches_) {
    if (index < patch.neurons()) {
      NeuronSample sample = patch.neuron(index);
      sample.neuron = number;
      return sample;
    }
    index -= patch.neurons();
  }
  return {};
}

std::size_t TactileModel::receptors() const noexcept {
  return std::accumulate(patches_.begin(), patches_.end(), std::size_t{0},
                         [](std::size_t sum, const TactilePatch& patch) {
                           return sum + patch.drive().receptors().size();
                         });
}

std::uint64_t TactileModel::spikes_refused() const noexcept {
  return std::accumulate(
      patches_.begin(), patches_.end(), spikes_.refused(),
      [](std::uint64_t sum, const TactilePatch& patch) { return sum + patch.spikes_refused(); });
}

void TactileModel::update_rim_distance(std::span<const PlacedContact> touching) noexcept {
  for (std::size_t i = 0; i < touching.size(); ++i) {
    for (std::size_t j = i + 1; j < touching.size(); ++j) {
      const double a = touching[i].contact.contact_radius_mm;
      const double b = touching[j].contact.contact_radius_mm;
      if (!(a > 0.0 && b > 0.0)) continue;
      const double apart =
          std::hypot(touching[i].x_mm - touching[j].x_mm, touching[i].y_mm - touching[j].y_mm);
      closest_rims_ = std::min(closest_rims_, (apart - a - b) / std::max(a, b));
    }
  }
}

void TactileModel::step_patch(std::size_t patch, WorkerTeam* team) noexcept {
  patches_[patch].step(touching_[patch], steps_, start_, team);
}

void TactileModel::step_patches(std::chrono::nanoseconds start) noexcept {
  start_ = start;
  const bool slides = std::any_of(sliding_.begin(), sliding_.end(),
                                  [](const auto& sliding) { return sliding != nullptr; });
  if (team_ == nullptr || (patches_.size() == 1 && !slides)) {
    for (std::size_t i = 0; i < patches_.size(); ++i) step_patch(i, team_);
    for (const auto& sliding : sliding_) {
      if (sliding) sliding->work();
    }
    return;
  }
  // A free thread takes the next contact or patch; they do not depend on each other.
  next_part_->store(0, std::memory_order_relaxed);
  const int parts = std::min(team_->size(), static_cast<int>(patches_.size() + sliding_.size()));
  team_->run(
      parts,
      [](void* context, int /*part*/) noexcept {
        auto* const self = static_cast<TactileModel*>(context);
        const std::size_t contacts = self->sliding_.size();
        for (;;) {
          const std::size_t i = self->next_part_->fetch_add(1, std::memory_order_relaxed);
          if (i >= contacts + self->patches_.size()) return;
          if (i >= contacts) {
            self->step_patch(i - contacts, nullptr);
          } else if (self->sliding_[i]) {
            self->sliding_[i]->work();
          }
        }
      },
      this);
}

void TactileModel::press_tips(std::span<const ContactInput> contacts) noexcept {
  for (std::size_t i = 0; i < tips_.size(); ++i) {
    if (sliding_[i]) {
      sliding_[i]->take(contacts[i]);
      presses_[i] = sliding_[i]->press();
    } else {
      presses_[i] = tips_[i].press(contacts[i]);
    }
  }
  const auto by_depth = [](const TipContact& tip) {
    return !tip.by_force() && (tip.sphere() != nullptr || tip.field() != nullptr);
  };
  if (tips_.size() == 1 || std::none_of(tips_.begin(), tips_.end(), by_depth)) return;
  for (std::size_t patch = 0; patch < patches_.size(); ++patch) {
    neighbours_.clear();
    for (std::size_t i = 0; i < tips_.size(); ++i) {
      if (parameters_.indenters[i].patch != patch || !presses_[i].touching()) continue;
      neighbours_.push_back({.tip = &tips_[i], .input = contacts[i], .press = presses_[i]});
    }
    if (neighbours_.size() < 2) continue;
    solve_neighbour_depths(neighbours_);
    std::size_t next = 0;
    for (std::size_t i = 0; i < tips_.size(); ++i) {
      if (parameters_.indenters[i].patch != patch || !presses_[i].touching()) continue;
      presses_[i] = neighbours_[next++].press;
    }
  }
}

void TactileModel::set_taxels(std::size_t indenter, std::span<const float> pressures_kPa) noexcept {
  if (taxels_[indenter]) taxels_[indenter]->press(pressures_kPa);
}

/// The contact of a tactile array. Its press has a force and an area, but no depth.
void TactileModel::touch(std::size_t indenter) noexcept {
  const TaxelField& taxels = *taxels_[indenter];
  Press& made = presses_[indenter];
  const Position& place = parameters_.indenters[indenter].taxels()->place;
  made = {.contact = {}, .x_mm = place.x_mm, .y_mm = place.y_mm};
  if (!taxels.touching()) return;
  made.contact.force_mN = taxels.force_mN();
  made.contact.contact_radius_mm = std::sqrt(taxels.area_mm2() / std::numbers::pi);
  made.contact.peak_pressure_kPa = taxels.peak_pressure_kPa();
  touching_[parameters_.indenters[indenter].patch].push_back({.contact = made.contact,
                                                              .taxels = &taxels,
                                                              .version = taxels.version(),
                                                              .x_mm = made.x_mm,
                                                              .y_mm = made.y_mm});
  if (made.contact.force_mN > deepest_[indenter].contact.force_mN) deepest_[indenter] = made;
}

std::span<SpikeEvent> TactileModel::step(std::span<const ContactInput> contacts_at_end,
                                         std::chrono::nanoseconds start) noexcept {
  assert(contacts_at_end.size() == tips_.size());
  for (auto& touching : touching_) touching.clear();
  press_tips(contacts_at_end);
  for (std::size_t i = 0; i < tips_.size(); ++i) {
    if (taxels_[i]) {
      touch(i);
      continue;
    }
    const Press& made = presses_[i];
    if (!made.touching()) continue;
    touching_[parameters_.indenters[i].patch].push_back(
        {.contact = made.contact,
         .field = tips_[i].field(),
         .version = sliding_[i] ? sliding_[i]->revision() : 0,
         .sliding = sliding_[i].get(),
         .x_mm = made.x_mm,
         .y_mm = made.y_mm,
         .reach_mm = sliding_[i] ? sliding_[i]->reach_mm()
                                 : reach_of_tip_[i].radius_mm(made.contact.depth_mm),
         .mask = reach_of_tip_[i].mask()});
    if (made.contact.depth_mm > deepest_[i].contact.depth_mm) deepest_[i] = made;
  }
  for (const auto& touching : touching_) update_rim_distance(touching);
  step_patches(start);
  spikes_.clear();
  resets_.clear();
  for (const TactilePatch& patch : patches_) {
    for (const SpikeEvent& spike : patch.spikes()) spikes_.push(spike);
    for (const SpikeEvent& reset : patch.resets()) resets_.push(reset);
  }
  if (patches_.size() > 1) spikes_.sort();
  resets_.sort();
  return spikes_.events();
}

}  // namespace merkel
