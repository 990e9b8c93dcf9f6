#pragma once

#include <chrono>
#include <cstdint>
#include <type_traits>

namespace merkel {

/// What drives one afferent and how far its membrane is, at the end of a tick: plain data that
/// crosses threads.
struct NeuronSample {
  std::chrono::nanoseconds time{0};  ///< probe time of the tick's end
  std::uint32_t neuron = 0;          ///< number through all patches, from 1
  float drive = 0.0F;      ///< current in µA/cm²; of neurons driven by energy density, in Hz
  float potential = 0.0F;  ///< mV; of integrate-and-fire neurons, in units of the threshold
};

static_assert(std::is_trivially_copyable_v<NeuronSample>);

}  // namespace merkel
