#pragma once

#include <optional>
#include <span>

namespace merkel {

/// The depth at which a probe meets the skin: where its force leaves the noise while its depth
/// moves. The force of the touch grows as the power 1.5 of the depth, by which the depth at the
/// threshold is corrected. Nothing: no touch yet, or it began before the noise was known.
/// \param depth_mm, force_N  readings in order of time, as many of each; at first nothing touches
[[nodiscard]] std::optional<double> skin_depth_mm(std::span<const double> depth_mm,
                                                  std::span<const double> force_N);

}  // namespace merkel
