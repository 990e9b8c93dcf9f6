#include "core/encoding/field_touch.hpp"

#include <cmath>

#include "core/units.hpp"

namespace merkel {

FieldTouch::FieldTouch(std::span<const EncoderSource> sources, const EncodedModel& model)
    : patch_of_probe_(model.patch_of_probe),
      force_N_(sources.size()),
      history_(sources.size(), TouchHistory(model.tick)) {
  for (const EncoderSource& each : sources) {
    fields_.push_back({each.map, each.settings.patch, each.settings.encoder});
  }
}

void FieldTouch::advance(std::size_t source, std::span<const Press> presses,
                         bool restarts) noexcept {
  const OfField& field = fields_[source];
  double force_mN = 0.0;
  double deepest_mm = 0.0;
  for (std::size_t i = 0; i < presses.size(); ++i) {
    const Press& press = presses[i];
    const double depth_mm = press.contact.depth_mm;
    // An array has no depth. NaN is no touch, but must go on.
    const bool free = depth_mm <= 0.0 && !press.touching();
    if (patch_of_probe_[i] != field.patch || free) continue;
    const double weight = field.map.weight(press.x_mm, press.y_mm, press.contact.contact_radius_mm);
    if (weight == 0.0) continue;
    force_mN += weight * press.contact.force_mN;
    // NaN wins over every other depth: the limiter must see it.
    if (std::isnan(depth_mm) || weight * depth_mm > deepest_mm) deepest_mm = weight * depth_mm;
  }
  force_N_[source] = units::N_from_mN(force_mN);
  const double value = field.encoder == EncoderKind::kBiomimetic ? force_N_[source] : deepest_mm;
  if (restarts) history_[source].reset(value);
  history_[source].push(value);
}

double FieldTouch::force_rate_N_per_s(std::size_t source) const noexcept {
  const auto forces_N = history_[source].at_intervals();
  return (forces_N[0] - forces_N[1]) / units::s_from(TouchHistory::kInterval);
}

}  // namespace merkel
