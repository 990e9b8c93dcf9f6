#pragma once

#include <cstdint>

namespace merkel {

/// Which neuron an afferent has. The first is driven by the summed currents of its receptors, the
/// others by the adapted mean of their energy densities.
enum class NeuronKind : std::uint8_t {
  kHodgkinHuxley,     ///< the paper's
  kIntegrateAndFire,  ///< leaky, noisy, driven by a rate
  kConnorStevens,     ///< Hodgkin-Huxley with an A-current, through its inverse f–I curve
};

}  // namespace merkel
