#include "core/scene/tactile_model.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

namespace merkel {
namespace {

Expected<void, ParameterError> check(const TactileModel::Parameters& p) {
  ParameterCheck all;
  all.also(p.skin.check())
      .also(p.patch.check())
      .also(p.transduction.check())
      .also(p.neuron.check())
      .also(p.network.check())
      .require(!p.indenters.empty(), "probe", "is missing: a scene needs at least one probe")
      .require(p.tick.count() > 0, "loop.tick_us", "must be a positive number of microseconds")
      .require(p.step.count() > 0, "neuron.step_us", "must be a positive number of microseconds");
  for (const Indenter& indenter : p.indenters) all.also(indenter.check(p.skin));
  if (const auto checked = all.result(); !checked) return checked;
  return ParameterCheck()
      .require(p.tick.count() % p.step.count() == 0, "neuron.step_us",
               "must divide loop.tick_us without remainder")
      .result();
}

}  // namespace

Expected<TactileModel, ParameterError> TactileModel::create(const Parameters& parameters) {
  if (const auto checked = check(parameters); !checked) {
    return Unexpected<ParameterError>(checked.error());
  }
  auto receptors = place_receptors(parameters.receptors, parameters.patch);
  if (!receptors) return Unexpected<ParameterError>(receptors.error());
  std::optional<LatticeCoupling> network;
  if (parameters.network.gain > 0.0) {
    auto coupling = LatticeCoupling::create(parameters.network, parameters.patch.columns,
                                            parameters.patch.rows);
    if (!coupling) return Unexpected<ParameterError>(coupling.error());
    network = std::move(*coupling);
  }
  return TactileModel(parameters, std::move(*receptors), std::move(network));
}

TactileModel::TactileModel(const Parameters& parameters, std::vector<Receptor> receptors,
                           std::optional<LatticeCoupling> network)
    : parameters_(parameters),
      steps_(static_cast<int>(parameters.tick / parameters.step)),
      drive_(receptors, static_cast<std::size_t>(parameters.patch.subregions()), parameters.skin,
             parameters.transduction),
      population_({.neuron = parameters.neuron,
                   .method = parameters.method,
                   .precision = parameters.precision,
                   .step = parameters.step,
                   .patch = 0},
                  static_cast<std::size_t>(parameters.patch.subregions()), std::move(network)),
      current_begin_(population_.size()),
      current_end_(population_.size()),
      // A membrane is refractory for more than a millisecond after a spike.
      spikes_(population_.size() *
              (2 + static_cast<std::size_t>(parameters.tick / std::chrono::milliseconds{1}))) {
  for (const Indenter& indenter : parameters.indenters)
    tips_.emplace_back(indenter, parameters.skin);
  touching_.reserve(tips_.size());
  deepest_.resize(tips_.size());
}

void TactileModel::reset() noexcept {
  population_.reset();
  std::fill(current_begin_.begin(), current_begin_.end(), 0.0);
  std::fill(current_end_.begin(), current_end_.end(), 0.0);
  std::fill(deepest_.begin(), deepest_.end(), Press{});
  closest_rims_ = std::numeric_limits<double>::infinity();
}

void TactileModel::note_distances() noexcept {
  for (std::size_t i = 0; i < touching_.size(); ++i) {
    for (std::size_t j = i + 1; j < touching_.size(); ++j) {
      const double a = touching_[i].contact.contact_radius_mm;
      const double b = touching_[j].contact.contact_radius_mm;
      if (!(a > 0.0 && b > 0.0)) continue;
      const double apart =
          std::hypot(touching_[i].x_mm - touching_[j].x_mm, touching_[i].y_mm - touching_[j].y_mm);
      closest_rims_ = std::min(closest_rims_, (apart - a - b) / std::max(a, b));
    }
  }
}

std::span<SpikeEvent> TactileModel::step(std::span<const ContactInput> contacts_at_end,
                                         std::chrono::nanoseconds start) noexcept {
  assert(contacts_at_end.size() == tips_.size());
  touching_.clear();
  for (std::size_t i = 0; i < tips_.size(); ++i) {
    const Press made = tips_[i].press(contacts_at_end[i]);
    if (!made.touching()) continue;
    touching_.push_back(
        {.contact = made.contact, .bars = tips_[i].bars(), .x_mm = made.x_mm, .y_mm = made.y_mm});
    if (made.contact.depth_mm > deepest_[i].contact.depth_mm) deepest_[i] = made;
  }
  note_distances();
  current_begin_.swap(current_end_);
  drive_.compute(touching_, current_end_);
  spikes_.clear();
  population_.advance(current_begin_, current_end_, steps_, start, spikes_);
  resets_ += population_.resets().size();
  spikes_.sort();
  return spikes_.events();
}

}  // namespace merkel
