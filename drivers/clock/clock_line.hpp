#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/expected.hpp"

namespace merkel {

/// Instants and the offsets of a clock measured there, s.
using ClockOffsets = std::vector<std::pair<double, double>>;

/// A clock as offset + drift·t, by a robust line through measured offsets, as pyxdf fits it.
struct ClockLine {
  double offset_s = 0.0;
  double drift = 0.0;
  double residual_s = 0.0;  ///< median; 0 with fewer than two offsets

  /// Fails if the clock was reset between two offsets: its times have no line. \param stream  its
  /// name, for the message
  [[nodiscard]] static Expected<ClockLine, SetupError> through(const ClockOffsets& offsets,
                                                               const std::string& stream);
  [[nodiscard]] double operator()(double time_s) const noexcept {
    return time_s + offset_s + drift * time_s;
  }
};

}  // namespace merkel
