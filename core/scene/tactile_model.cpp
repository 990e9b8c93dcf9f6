#include "core/scene/tactile_model.hpp"

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>
#include <variant>
#include <vector>

#include "core/contact/neighbour_depths.hpp"
#include "core/contact/sliding_contact.hpp"
#include "core/contact/taxel_field.hpp"
#include "core/contact/tip_contact.hpp"
#include "core/neurons/spike_buffer.hpp"
#include "core/scene/drive_reach.hpp"
#include "core/scene/model_check.hpp"
#include "core/scene/patch_layout.hpp"
#include "core/scene/tactile_patch.hpp"
#include "core/units.hpp"
#include "core/worker_team.hpp"

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

/// What a model consists of, apart from its header: sources that use a model need not compile it.
class TactileModel::State {
 public:
  State(const Parameters& parameters, std::vector<TactilePatch> patches);

 private:
  friend class TactileModel;
  [[nodiscard]] std::size_t neurons() const noexcept;
  void update_rim_distance(std::span<const PlacedContact> touching) noexcept;
  /// Writes presses_; depth-controlled tips on one patch share the skin that they displace.
  void press_tips(std::span<const ContactInput> contacts) noexcept;
  void touch(std::size_t indenter) noexcept;
  /// Steps the patches and solves the contacts of sliding surfaces, which serve later ticks.
  void step_patches(std::chrono::nanoseconds start) noexcept;
  void step_patch(std::size_t patch, WorkerTeam* team) noexcept;

  Parameters parameters_;
  int steps_;  ///< of the neurons in a tick
  std::vector<TipContact> tips_;
  std::vector<std::unique_ptr<SlidingContact>> sliding_;  ///< of each tip; null: does not slide
  std::vector<DriveReach> reach_of_tip_;
  std::vector<std::unique_ptr<TaxelField>> taxels_;  ///< by indenter; null: not a tactile array
  std::vector<TactilePatch> patches_;
  std::vector<std::vector<PlacedContact>> touching_;  ///< by patch
  std::vector<Press> presses_;                        ///< of this tick
  std::vector<NeighbourPress> neighbours_;            ///< on one patch
  std::vector<Press> deepest_;
  double closest_rims_ = std::numeric_limits<double>::infinity();
  WorkerTeam* team_ = nullptr;
  std::chrono::nanoseconds start_{0};  ///< of the step in progress
  /// Next contact to solve or patch to step, shared by the threads.
  std::atomic<std::size_t> next_part_{0};
  SpikeBuffer spikes_;
  SpikeBuffer resets_;
};

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
  return TactileModel(std::make_unique<State>(parameters, std::move(patches)));
}

TactileModel::State::State(const Parameters& parameters, std::vector<TactilePatch> patches)
    : parameters_(parameters),
      steps_(static_cast<int>(parameters.tick / parameters.step)),
      patches_(std::move(patches)),
      touching_(patches_.size()),
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

TactileModel::TactileModel(std::unique_ptr<State> state) noexcept : state_(std::move(state)) {}
TactileModel::TactileModel(TactileModel&&) noexcept = default;
TactileModel& TactileModel::operator=(TactileModel&&) noexcept = default;
TactileModel::~TactileModel() = default;

void TactileModel::share_work(WorkerTeam* team) noexcept { state_->team_ = team; }

Press TactileModel::press(std::size_t indenter, const ContactInput& input) const noexcept {
  return state_->tips_[indenter].press(input);
}

const TactileModel::Parameters& TactileModel::parameters() const noexcept {
  return state_->parameters_;
}
std::size_t TactileModel::indenters() const noexcept { return state_->tips_.size(); }
std::span<const TactilePatch> TactileModel::patches() const noexcept { return state_->patches_; }
std::size_t TactileModel::neurons() const noexcept { return state_->neurons(); }
bool TactileModel::touched(std::size_t patch) const noexcept {
  return !state_->touching_[patch].empty();
}
std::span<const Press> TactileModel::presses() const noexcept { return state_->presses_; }
std::span<const Press> TactileModel::deepest() const noexcept { return state_->deepest_; }
double TactileModel::closest_rims() const noexcept { return state_->closest_rims_; }
const SlidingContact* TactileModel::sliding(std::size_t indenter) const noexcept {
  return state_->sliding_[indenter].get();
}
std::span<const SpikeEvent> TactileModel::resets() const noexcept {
  return state_->resets_.events();
}

void TactileModel::reset() noexcept {
  for (TactilePatch& patch : state_->patches_) patch.reset();
  for (const auto& sliding : state_->sliding_) {
    if (sliding) sliding->reset();
  }
  std::fill(state_->presses_.begin(), state_->presses_.end(), Press{});
  std::fill(state_->deepest_.begin(), state_->deepest_.end(), Press{});
  for (const auto& taxels : state_->taxels_) {
    if (taxels) taxels->release();
  }
  state_->closest_rims_ = std::numeric_limits<double>::infinity();
}

std::size_t TactileModel::State::neurons() const noexcept {
  return std::accumulate(
      patches_.begin(), patches_.end(), std::size_t{0},
      [](std::size_t sum, const TactilePatch& patch) { return sum + patch.neurons(); });
}

NeuronSample TactileModel::neuron(std::uint32_t number) const noexcept {
  std::size_t index = number - 1;
  for (const TactilePatch& patch : state_->patches_) {
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
  return std::accumulate(state_->patches_.begin(), state_->patches_.end(), std::size_t{0},
                         [](std::size_t sum, const TactilePatch& patch) {
                           return sum + patch.drive().receptors().size();
                         });
}

std::uint64_t TactileModel::spikes_refused() const noexcept { return state_->spikes_.refused(); }

void TactileModel::State::update_rim_distance(std::span<const PlacedContact> touching) noexcept {
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

void TactileModel::State::step_patch(std::size_t patch, WorkerTeam* team) noexcept {
  patches_[patch].step(touching_[patch], steps_, start_, team);
}

void TactileModel::State::step_patches(std::chrono::nanoseconds start) noexcept {
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
  next_part_.store(0, std::memory_order_relaxed);
  const int parts = std::min(team_->size(), static_cast<int>(patches_.size() + sliding_.size()));
  team_->run(
      parts,
      [](void* context, int /*part*/) noexcept {
        auto* const self = static_cast<State*>(context);
        const std::size_t contacts = self->sliding_.size();
        for (;;) {
          const std::size_t i = self->next_part_.fetch_add(1, std::memory_order_relaxed);
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

void TactileModel::State::press_tips(std::span<const ContactInput> contacts) noexcept {
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
  if (state_->taxels_[indenter]) state_->taxels_[indenter]->press(pressures_kPa);
}

/// The contact of a tactile array. Its press has a force and an area, but no depth.
void TactileModel::State::touch(std::size_t indenter) noexcept {
  const TaxelField& taxels = *taxels_[indenter];
  Press& made = presses_[indenter];
  const Position& place = parameters_.indenters[indenter].taxels()->place;
  made = {.contact = {}, .x_mm = place.x_mm, .y_mm = place.y_mm};
  if (!taxels.touching()) return;
  made.x_mm = taxels.centre().x_mm;
  made.y_mm = taxels.centre().y_mm;
  made.contact.force_mN = taxels.force_mN();
  made.contact.contact_radius_mm = std::sqrt(taxels.area_mm2() / std::numbers::pi);
  made.contact.peak_pressure_kPa = taxels.peak_pressure_kPa();
  touching_[parameters_.indenters[indenter].patch].push_back({.contact = made.contact,
                                                              .taxels = &taxels,
                                                              .version = taxels.version(),
                                                              .x_mm = place.x_mm,
                                                              .y_mm = place.y_mm});
  if (made.contact.force_mN > deepest_[indenter].contact.force_mN) deepest_[indenter] = made;
}

std::span<SpikeEvent> TactileModel::step(std::span<const ContactInput> contacts_at_end,
                                         std::chrono::nanoseconds start) noexcept {
  assert(contacts_at_end.size() == state_->tips_.size());
  for (auto& touching : state_->touching_) touching.clear();
  state_->press_tips(contacts_at_end);
  for (std::size_t i = 0; i < state_->tips_.size(); ++i) {
    if (state_->taxels_[i]) {
      state_->touch(i);
      continue;
    }
    const Press& made = state_->presses_[i];
    if (!made.touching()) continue;
    state_->touching_[state_->parameters_.indenters[i].patch].push_back(
        {.contact = made.contact,
         .field = state_->tips_[i].field(),
         .version = state_->sliding_[i] ? state_->sliding_[i]->revision() : 0,
         .sliding = state_->sliding_[i].get(),
         .x_mm = made.x_mm,
         .y_mm = made.y_mm,
         .reach_mm = state_->sliding_[i]
                         ? state_->sliding_[i]->reach_mm()
                         : state_->reach_of_tip_[i].radius_mm(made.contact.depth_mm),
         .mask = state_->reach_of_tip_[i].mask()});
    if (made.contact.depth_mm > state_->deepest_[i].contact.depth_mm) state_->deepest_[i] = made;
  }
  for (const auto& touching : state_->touching_) state_->update_rim_distance(touching);
  state_->step_patches(start);
  state_->spikes_.clear();
  state_->resets_.clear();
  for (const TactilePatch& patch : state_->patches_) {
    state_->spikes_.append(patch.spikes());
    for (const SpikeEvent& reset : patch.resets()) state_->resets_.push(reset);
  }
  if (state_->patches_.size() > 1) state_->spikes_.sort();
  state_->resets_.sort();
  return state_->spikes_.events();
}

}  // namespace merkel
