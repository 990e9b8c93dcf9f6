#include "core/encoding/field_activity.hpp"

#include <algorithm>

#include "core/math/decay.hpp"
#include "core/units.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

/// Smaller sums are set to 0, because subnormal numbers are slow.
constexpr double kLeastSum = 1e-12;
/// Weights refer to the present again before they could overflow.
constexpr double kLeastDecayed = 1e-100;

/// Whether the centre of an afferent lies in a field; false without receptors, because it never
/// fires.
bool in_field(const AfferentSite& afferent, const Electrode& electrode) {
  if (afferent.receptors == 0) return false;
  const double dx_mm = afferent.x_mm - electrode.field_mm[0];
  const double dy_mm = afferent.y_mm - electrode.field_mm[1];
  return dx_mm * dx_mm + dy_mm * dy_mm <= electrode.field_mm[2] * electrode.field_mm[2];
}

}  // namespace

FieldActivity::FieldActivity(std::span<const Electrode> electrodes, const EncodedModel& model) {
  std::vector<std::size_t> first_of_patch;  // number of the first afferent, from 0
  std::size_t afferents = 0;
  for (const EncodedModel::OfPatch& patch : model.patches) {
    first_of_patch.push_back(afferents);
    afferents += patch.afferents.size();
  }
  std::vector<std::vector<Membership>> of_afferent(afferents);
  std::uint32_t slot = 0;
  for (std::size_t e = 0; e < electrodes.size(); ++e) {
    const double per_ns = 1.0 / static_cast<double>(electrodes[e].window.count());
    fields_.push_back({.encoder = electrodes[e].encoder,
                       .per_ns = per_ns,
                       .kept = decay(static_cast<double>(model.tick.count()) * per_ns),
                       .first_slot = slot});
    const auto& places = model.patches[electrodes[e].patch].afferents;
    for (std::size_t n = 0; n < places.size(); ++n) {
      if (!in_field(places[n], electrodes[e])) continue;
      of_afferent[first_of_patch[electrodes[e].patch] + n].push_back(
          {.electrode = static_cast<std::uint32_t>(e), .slot = slot++});
      ++fields_.back().afferents;
    }
  }
  for (const auto& each : of_afferent) {
    first_membership_.push_back(memberships_.size());
    memberships_.insert(memberships_.end(), each.begin(), each.end());
  }
  first_membership_.push_back(memberships_.size());
  weights_.resize(slot);
}

std::span<const FieldActivity::Membership> FieldActivity::memberships(
    const SpikeEvent& spike) const noexcept {
  const std::size_t afferent = spike.neuron - 1;
  return std::span(memberships_)
      .subspan(first_membership_[afferent],
               first_membership_[afferent + 1] - first_membership_[afferent]);
}

void FieldActivity::reset() noexcept {
  for (std::size_t e = 0; e < fields_.size(); ++e) reset(e);
}

void FieldActivity::reset(std::size_t electrode) noexcept {
  Field& field = fields_[electrode];
  field.sum = 0.0;
  std::fill_n(weights_.begin() + field.first_slot, field.afferents, 0.0);
}

void FieldActivity::advance(std::span<const SpikeEvent> spikes, nanoseconds end) noexcept {
  for (Field& field : fields_) {
    field.sum *= field.kept;
    if (field.sum < kLeastSum) field.sum = 0.0;
    if (field.encoder != EncoderKind::kRecruited) continue;
    field.decayed *= field.kept;
    if (field.decayed > kLeastDecayed) continue;
    double* const weights = weights_.data() + field.first_slot;
    for (std::size_t k = 0; k < field.afferents; ++k) {
      weights[k] *= field.decayed;
      if (weights[k] < kLeastSum) weights[k] = 0.0;
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
    Field& field = fields_[membership.electrode];
    if (field.encoder != EncoderKind::kRate && field.encoder != EncoderKind::kRecruited) continue;
    if (field.per_ns != of_per_ns) {
      of_per_ns = field.per_ns;
      added = decay(age_ns * of_per_ns);
    }
    field.sum += added;
    if (field.encoder == EncoderKind::kRate) continue;
    double& weight = weights_[membership.slot];
    field.sum -= weight * field.decayed;
    weight = added / field.decayed;
  }
}

double FieldActivity::rate_Hz(std::size_t electrode) const noexcept {
  const Field& field = fields_[electrode];
  return field.sum * field.per_ns * 1e9 / static_cast<double>(field.afferents);
}

double FieldActivity::recruited_share(std::size_t electrode) const noexcept {
  const Field& field = fields_[electrode];
  return std::clamp(field.sum / static_cast<double>(field.afferents), 0.0, 1.0);
}

}  // namespace merkel
