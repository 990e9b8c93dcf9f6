#pragma once

#include <chrono>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "drivers/clock/clock_map.hpp"

namespace merkel {

/// Pulses of one line as two clocks saw them.
struct PulseMatch {
  std::vector<ClockReading> pairs;                    ///< pulses that both saw, in order
  std::size_t total = 0;                              ///< the first clock's, within the common time
  std::size_t total_other = 0;                        ///< the second clock's
  std::chrono::nanoseconds tolerance{0};              ///< used, see match_pulses()
  std::vector<std::chrono::nanoseconds> residuals{};  ///< of the pairs, once fitted
};

/// Finds the pulses that both sequences have, by the lengths of their intervals. Either may lack
/// pulses and have others; the clocks may differ by any offset and up to 1000 ppm. Fails with a
/// sentence where no place, several places, or only a part of the common time fits.
/// \param from, to   times of pulses, increasing
/// \param tolerance  how far the time of a pulse may be off; at most an eighth of short intervals
/// are used
[[nodiscard]] Expected<PulseMatch, std::string> match_pulses(
    std::span<const std::chrono::nanoseconds> from, std::span<const std::chrono::nanoseconds> to,
    std::chrono::nanoseconds tolerance);

/// Fits the clocks to matched pulses by fit_clocks(), to means of neighbouring pulses where they
/// are many. Drops pairs that are far from their neighbours, and sets the residuals of the others.
/// \param first, last  the times to convert
[[nodiscard]] ClockFit fit_pulses(PulseMatch& match, std::chrono::nanoseconds first,
                                  std::chrono::nanoseconds last);

}  // namespace merkel
