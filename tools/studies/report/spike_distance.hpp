#pragma once

#include <span>

namespace merkel {

/// The distance of Victor & Purpura (J. Neurophysiol. 76 (1996) 1310): the least cost of
/// transforming one spike train into another. Adding or removing a spike costs 1; moving one costs
/// `cost_per_s` per second. Times in s, in order.
[[nodiscard]] double victor_purpura_distance(std::span<const double> a, std::span<const double> b,
                                             double cost_per_s);

/// The distance of van Rossum (Neural Comput. 13 (2001) 751): √(1/τ·∫(f−g)² dt), f and g the trains
/// with an exponential of time constant τ at every spike. An additional spike contributes √½.
[[nodiscard]] double van_rossum_distance(std::span<const double> a, std::span<const double> b,
                                         double tau_s);

/// Vector strength of spikes in a cycle: |mean of e^{2πi·f·t}|, 1 if all have the same phase.
/// NaN without spikes.
[[nodiscard]] double vector_strength(std::span<const double> spikes, double frequency_hz);

}  // namespace merkel
