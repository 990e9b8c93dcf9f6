#pragma once

#include <cstdint>

#include "core/neurons/step_call.hpp"

namespace merkel {

/// Integrate-and-fire neurons as a structure of arrays, and the steps to take. Times in s, rates in
/// Hz. All arrays are padded to whole blocks.
struct IntegrateAndFireArguments {
  double* v = nullptr;
  double* refractory_left = nullptr;         ///< s
  const double* input_begin = nullptr;       ///< Hz at the beginning of the first step
  const double* input_change = nullptr;      ///< change until the end of the last step
  const std::uint64_t* noise_key = nullptr;  ///< of the eight pairs of neurons in each block
  StepCall call;
  double step = 0.0;
  double inverse_tau = 0.0;
  double threshold = 1.0;
  double reset = 0.0;
  double floor = -1.0;
  double refractory = 0.0;
  double sigma = 0.0;
  double share_per_Hz = 0.0;  ///< share of the noise variance per Hz of drive, up to 1
  double least_share = 1.0;
  double rest_below = 0.0;  ///< without drive, |v| below this is set to 0
};

/// Takes all steps by the Euler-Maruyama method. Bit-identical on every instruction set.
/// Real-time: yes.
void step_integrate_and_fire(const IntegrateAndFireArguments& arguments) noexcept;

}  // namespace merkel
