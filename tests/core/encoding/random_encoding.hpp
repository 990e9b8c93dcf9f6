#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <vector>

#include "core/encoding/encoding_parameters.hpp"
#include "core/encoding/stimulation_limiter.hpp"
#include "core/math/random.hpp"
#include "tests/core/encoding/command_auditor.hpp"
#include "tests/core/encoding/tick_feed.hpp"

namespace merkel {

/// Makes the first electrodes a group.
inline void add_group(Random& random, EncodingParameters& parameters) {
  const auto members = 2 + random.next() % 3;
  ElectrodeGroup& group = parameters.groups.emplace_back();
  group.pattern.name = "group";
  group.pattern.border_mm = random.uniform(0.0, 3.0);
  group.pattern.window = parameters.electrodes[0].window;
  group.pattern.full_rate_Hz = parameters.electrodes[0].full_rate_Hz;
  group.pattern.encoder = random.uniform() < 0.5 ? EncoderKind::kRate : EncoderKind::kLinear;
  group.pattern.frequency_Hz = {random.uniform(0.0, 50.0),
                                1000.0 / static_cast<double>(members) - random.uniform(0.0, 100.0)};
  if (random.uniform() < 0.5) group.max_charge_nC_per_s = random.uniform(500.0, 5000.0);
  for (std::size_t e = 0; e < members; ++e) {
    parameters.electrodes[e].group = 0;
    parameters.electrodes[e].group_weight = random.uniform(0.1, 1.0);
  }
  parameters.join_groups();
}

/// Electrodes of every kind with random fields, ranges and limits, for a patch of 30 by 20 mm.
/// \param least_radius_mm  smallest radius of a field; larger where afferents are sparse
inline EncodingParameters random_encoding(Random& random, double least_radius_mm) {
  EncodingParameters parameters = encoding_of({});
  StimulationParameters& limits = parameters.stimulation;
  limits.update = (1 + random.next() % 30) * std::chrono::milliseconds{1};
  limits.phase = std::chrono::nanoseconds{static_cast<std::int64_t>(random.uniform(5e4, 4e5))};
  limits.max_total_uA = random.uniform(90.0, 400.0);
  if (random.uniform() < 0.5) limits.max_slope_uA_per_s = random.uniform(500.0, 1e5);
  const auto electrodes = 1 + random.next() % 12;
  if (random.uniform() < 0.3) {
    limits.max_electrodes = static_cast<std::int64_t>(1 + random.next() % electrodes);
  }
  for (std::size_t e = 0; e < electrodes; ++e) {
    const auto kind = static_cast<EncoderKind>(random.next() % 7);
    const double x_mm = random.uniform(2.0, 28.0);
    const double y_mm = random.uniform(2.0, 18.0);
    auto electrode = electrode_at("E" + std::to_string(e), kind, x_mm, y_mm,
                                  least_radius_mm + random.uniform(0.0, 7.0));
    electrode.amplitude_uA = {random.uniform(0.0, 40.0), random.uniform(40.0, 90.0)};
    electrode.frequency_Hz = {random.uniform(0.0, 50.0), random.uniform(50.0, 1000.0)};
    electrode.window =
        std::chrono::nanoseconds{static_cast<std::int64_t>(random.uniform(1e6, 2e8))};
    electrode.full_rate_Hz = random.uniform(1.0, 100.0);
    if (random.uniform() < 0.3) {
      electrode.phase =
          std::chrono::nanoseconds{static_cast<std::int64_t>(random.uniform(5e4, 4e5))};
      electrode.max_charge_nC = charge_nC(electrode.amplitude_uA[1], *electrode.phase);
    }
    if (random.uniform() < 0.3) electrode.max_slope_uA_per_s = random.uniform(500.0, 1e5);
    parameters.electrodes.push_back(electrode);
  }
  limits.max_charge_nC = charge_nC(90.0, limits.phase);
  if (random.uniform() < 0.5) limits.interphase = std::chrono::microseconds{random.next() % 100};
  if (random.uniform() < 0.3) limits.second_phase = std::chrono::microseconds{400};
  if (parameters.electrodes.size() >= 4 && random.uniform() < 0.5) add_group(random, parameters);
  return parameters;
}

/// The limits that an auditor checks commands against: those of the scene.
inline CommandAuditor auditor_of(const EncodingParameters& parameters) {
  const StimulationParameters& stimulation = parameters.stimulation;
  StimulationLimiter::Limits limits{.max_total_uA = stimulation.max_total_uA};
  if (stimulation.max_electrodes) {
    limits.max_electrodes = static_cast<std::size_t>(*stimulation.max_electrodes);
  }
  std::vector<StimulationLimiter::OfElectrode> ranges;
  for (const Electrode& each : parameters.electrodes) {
    const auto slope =
        each.max_slope_uA_per_s ? each.max_slope_uA_per_s : stimulation.max_slope_uA_per_s;
    ranges.push_back(
        {.max_uA = each.amplitude_uA[1],
         .max_Hz = each.frequency_Hz[1],
         .phase = each.phase.value_or(stimulation.phase),
         .max_charge_nC = each.max_charge_nC.value_or(stimulation.max_charge_nC),
         .max_slope_uA_per_s = slope.value_or(StimulationLimiter::kNone),
         .pulse = each.phase.value_or(stimulation.phase) + stimulation.interphase +
                  stimulation.second_phase.value_or(each.phase.value_or(stimulation.phase)),
         .group = each.group.value_or(StimulationLimiter::kNoGroup)});
  }
  for (const ElectrodeGroup& group : parameters.groups) {
    limits.groups.push_back({.max_charge_nC_per_s = group.max_charge_nC_per_s.value_or(1e12)});
  }
  return {limits, std::move(ranges), std::chrono::nanoseconds{0}};
}

}  // namespace merkel
