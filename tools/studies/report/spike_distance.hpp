#pragma once

#include <span>

namespace merkel {

/// The distance of Victor & Purpura (J. Neurophysiol. 76 (1996) 1310): the least cost of turning
/// one spike train into another, where a spike is added or removed at the cost 1 and moved at
/// `cost_per_s` a second. Times in s, in order.
[[nodiscard]] double victor_purpura_distance(std::span<const double> a, std::span<const double> b,
                                             double cost_per_s);

/// The distance of van Rossum (Neural Comput. 13 (2001) 751): √(1/τ·∫(f−g)² dt), f and g the trains
/// with an exponential of time constant τ at every spike. A spike too many costs √½.
[[nodiscard]] double van_rossum_distance(std::span<const double> a, std::span<const double> b,
                                         double tau_s);

/// How strongly spikes prefer a phase of a cycle: |mean of e^{2πi·f·t}|, 1 where all have the same.
/// NaN without spikes.
[[nodiscard]] double vector_strength(std::span<const double> spikes, double frequency_hz);

}  // namespace merkel
