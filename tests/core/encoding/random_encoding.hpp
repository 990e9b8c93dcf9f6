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
    const auto kind = static_cast<EncoderKind>(random.next() % 5);
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
    ranges.push_back({.max_uA = each.amplitude_uA[1],
                      .max_Hz = each.frequency_Hz[1],
                      .phase = each.phase.value_or(stimulation.phase),
                      .max_charge_nC = each.max_charge_nC.value_or(stimulation.max_charge_nC),
                      .max_slope_uA_per_s = slope.value_or(StimulationLimiter::kNone)});
  }
  return {limits, std::move(ranges), std::chrono::nanoseconds{0}};
}

}  // namespace merkel
