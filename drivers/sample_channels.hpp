#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "core/records/probe_sample.hpp"
#include "core/units.hpp"

namespace merkel {

/// A channel of ProbeSample, as files, streams and devices give it: forces in N, lengths in mm.
struct SampleChannel {
  ProbeSample::Channel bit;
  std::string_view name;
  std::string_view unit;
  std::string_view column;  ///< name and unit
  double ProbeSample::*member;
  int power = 0;  ///< of ten, from the member's unit to `unit`

  /// Whether it is among a sample's or probe's channels.
  [[nodiscard]] constexpr bool in(std::uint32_t channels) const noexcept {
    return (channels & bit) != 0U;
  }
  /// The value in `unit`.
  [[nodiscard]] constexpr double of(const ProbeSample& sample) const noexcept {
    return power == 0 ? sample.*member : units::N_from_mN(sample.*member);
  }
  /// Sets a value in `unit`.
  constexpr void set(ProbeSample& sample, double value) const noexcept {
    sample.*member = power == 0 ? value : units::mN_from_N(value);
  }
};

inline constexpr std::array<SampleChannel, 4> kProbeChannels = {
    {{ProbeSample::kDepth, "depth", "mm", "depth_mm", &ProbeSample::depth_mm},
     {ProbeSample::kForce, "force", "N", "force_N", &ProbeSample::force_mN, -3},
     {ProbeSample::kX, "x", "mm", "x_mm", &ProbeSample::x_mm},
     {ProbeSample::kY, "y", "mm", "y_mm", &ProbeSample::y_mm}}};

}  // namespace merkel
