#include "core/encoding/field_activity.hpp"

#include <algorithm>

#include "core/math/decay.hpp"
#include "core/units.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

/// Smaller sums are set to 0, because subnormal numbers are slow.
constexpr double kMinSum = 1e-12;
/// Weights refer to the present again before they could overflow.
constexpr double kMinDecayed = 1e-100;

}  // namespace

FieldActivity::FieldActivity(std::span<const EncoderSource> sources, const EncodedModel& model) {
  std::vector<std::size_t> first_of_patch;  // number of the first afferent, from 0
  std::size_t afferents = 0;
  for (const EncodedModel::OfPatch& patch : model.patches) {
    first_of_patch.push_back(afferents);
    afferents += patch.afferents.size();
  }
  std::vector<std::vector<Membership>> of_afferent(afferents);
  for (std::size_t s = 0; s < sources.size(); ++s) {
    const Electrode& settings = sources[s].settings;
    const double per_ns = 1.0 / static_cast<double>(settings.window.count());
    Field& field =
        fields_.emplace_back(Field{.encoder = settings.encoder,
                                   .per_ns = per_ns,
                                   .kept = decay(static_cast<double>(model.tick.count()) * per_ns),
                                   .first_slot = static_cast<std::uint32_t>(map_.size())});
    const auto& places = model.patches[settings.patch].afferents;
    for (std::size_t n = 0; n < places.size(); ++n) {
      const double weight = sources[s].map.weight(places[n].x_mm, places[n].y_mm);
      // An afferent without receptors never fires.
      if (places[n].receptors == 0 || weight == 0.0) continue;
      of_afferent[first_of_patch[settings.patch] + n].push_back(
          {.source = static_cast<std::uint32_t>(s),
           .slot = static_cast<std::uint32_t>(map_.size())});
      map_.push_back(weight);
      field.total_weight += weight;
      field.weighted = field.weighted || weight != 1.0;
      ++field.afferents;
    }
  }
  for (const auto& each : of_afferent) {
    first_membership_.push_back(memberships_.size());
    memberships_.insert(memberships_.end(), each.begin(), each.end());
  }
  first_membership_.push_back(memberships_.size());
  weights_.resize(map_.size());
}

std::span<const FieldActivity::Membership> FieldActivity::memberships(
    const SpikeEvent& spike) const noexcept {
  const std::size_t afferent = spike.neuron - 1;
  return std::span(memberships_)
      .subspan(first_membership_[afferent],
               first_membership_[afferent + 1] - first_membership_[afferent]);
}

void FieldActivity::reset() noexcept {
  for (std::size_t s = 0; s < fields_.size(); ++s) reset(s);
}

void FieldActivity::reset(std::size_t source) noexcept {
  Field& field = fields_[source];
  field.sum = 0.0;
  std::fill_n(weights_.begin() + field.first_slot, field.afferents, 0.0);
}

void FieldActivity::advance(std::span<const SpikeEvent> spikes, nanoseconds end) noexcept {
  for (Field& field : fields_) {
    field.sum *= field.kept;
    if (field.sum < kMinSum) field.sum = 0.0;
    if (field.encoder != EncoderKind::kRecruited) continue;
    field.decayed *= field.kept;
    if (field.decayed > kMinDecayed) continue;
    double* const weights = weights_.data() + field.first_slot;
    for (std::size_t k = 0; k < field.afferents; ++k) {
      weights[k] *= field.decayed;
      if (weights[k] < kMinSum) weights[k] = 0.0;
    }
    field.decayed = 1.0;
  }
  for (const SpikeEvent& spike : spikes) add(spike, end);
}

void FieldActivity::add(const SpikeEvent& spike, nanoseconds end) noexcept {
  const double age_ns = static_cast<double>((end - spike.time).count());
  double of_per_ns = -1.0;  // most fields share one window
  double added = 0.0;
  for (const Membership& membership : memberships(spike)) {
    Field& field = fields_[membership.source];
    if (field.encoder != EncoderKind::kRate && field.encoder != EncoderKind::kRecruited) continue;
    if (field.per_ns != of_per_ns) {
      of_per_ns = field.per_ns;
      added = decay(age_ns * of_per_ns);
    }
    const double share = field.weighted ? added * map_[membership.slot] : added;
    field.sum += share;
    if (field.encoder == EncoderKind::kRate) continue;
    double& weight = weights_[membership.slot];
    field.sum -= weight * field.decayed;
    weight = share / field.decayed;
  }
}

double FieldActivity::rate_Hz(std::size_t source) const noexcept {
  const Field& field = fields_[source];
  return field.sum * field.per_ns * 1e9 / field.total_weight;
}

double FieldActivity::recruited_share(std::size_t source) const noexcept {
  const Field& field = fields_[source];
  return std::clamp(field.sum / field.total_weight, 0.0, 1.0);
}

}  // namespace merkel
