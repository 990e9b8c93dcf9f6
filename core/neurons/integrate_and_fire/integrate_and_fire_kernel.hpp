#pragma once

#include <cstdint>

#include "core/neurons/step_call.hpp"

namespace merkel {

/// Integrate-and-fire neurons as structure of arrays, and what to do with them. Times in s, rates
/// in Hz. All arrays are padded to whole blocks.
struct IntegrateAndFireArguments {
  double* v = nullptr;
  double* refractory_left = nullptr;         ///< s
  const double* input_begin = nullptr;       ///< Hz at the first step's beginning
  const double* input_change = nullptr;      ///< by the last step's end
  const std::uint64_t* noise_key = nullptr;  ///< of each block's eight pairs of neurons
  StepCall call;
  double step = 0.0;
  double inverse_tau = 0.0;
  double threshold = 1.0;
  double reset = 0.0;
  double floor = -1.0;
  double refractory = 0.0;
  double sigma = 0.0;
  double share_per_Hz = 0.0;  ///< of the variance of the noise, by the drive, up to 1
  double least_share = 1.0;
  double rest_below = 0.0;  ///< without drive, a smaller |v| is 0
};

/// Takes all steps by the Euler-Maruyama method. Bit-identical on every instruction set.
/// Real-time: yes.
void step_integrate_and_fire(const IntegrateAndFireArguments& arguments) noexcept;

}  // namespace merkel
