#pragma once

#include <chrono>
#include <cstdint>
#include <type_traits>

namespace merkel {

/// Drive and membrane potential of one afferent at the end of a tick: plain data that crosses
/// threads.
struct NeuronSample {
  std::chrono::nanoseconds time{0};  ///< probe time of the tick's end
  std::uint32_t neuron = 0;          ///< number across all patches, from 1
  float drive = 0.0F;      ///< current in µA/cm²; Hz for neurons driven by energy density
  float potential = 0.0F;  ///< mV; for integrate-and-fire neurons, in units of the threshold
};

static_assert(std::is_trivially_copyable_v<NeuronSample>);

}  // namespace merkel
