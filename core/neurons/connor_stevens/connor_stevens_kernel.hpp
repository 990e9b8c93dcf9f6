#pragma once

#include <cstddef>
#include <cstdint>

#include "core/neurons/connor_stevens/connor_stevens.hpp"
#include "core/neurons/step_call.hpp"
#include "core/simd/aligned_array.hpp"

namespace merkel {

/// One step of the five gates as a function of the potential: x → p·x + q with p = e^{−dt/τ} and q
/// = x∞·(1−p). p and q are interpolated linearly between potentials 1/16 mV apart, which is within
/// 1e-5 of the exact step. Outside −120 … 80 mV the values at the ends apply.
class GateTable {
 public:
  static constexpr double kLowest_mV = -120.0;
  static constexpr double kHighest_mV = 80.0;
  static constexpr double kPer_mV = 16.0;
  static constexpr std::size_t kGates = 5;         ///< m, h, n, a, b
  static constexpr std::size_t kRow = 4 * kGates;  ///< p, its change to the next row, q, its change

  explicit GateTable(double step_ms);
  [[nodiscard]] const double* data() const noexcept { return values_.data(); }

 private:
  AlignedArray<double> values_;
};

/// Connor-Stevens neurons as a structure of arrays, and the steps to take. All arrays are padded to
/// whole blocks.
struct ConnorStevensArguments {
  double* V = nullptr;
  double* gates[GateTable::kGates] = {};
  const double* input_begin = nullptr;       ///< µA/cm² at the beginning of the first step
  const double* input_change = nullptr;      ///< change until the end of the last step
  const std::uint64_t* noise_key = nullptr;  ///< of the eight pairs of neurons in each block
  StepCall call;
  double step_ms = 0.0;
  double noise_per_step = 0.0;  ///< σ·√dt
  /// The noise variance is multiplied by (input − quiet)·share_per_input, limited to least … 1.
  double quiet_input = 0.0;
  double share_per_input = 0.0;
  double least_share = 1.0;
  const ConnorStevens* neuron = nullptr;
  const double* gate_table = nullptr;
  double resting_V_mV = 0.0;  ///< for neurons whose state turns non-finite
  double resting_gates[GateTable::kGates] = {};
};

/// Takes all steps. Gates and potential are staggered by half a step: the gates take exact
/// exponential steps, the potential Crank–Nicolson steps; then the noise is added. Bit-identical on
/// every instruction set. Real-time: yes.
void step_connor_stevens(const ConnorStevensArguments& arguments) noexcept;

}  // namespace merkel
