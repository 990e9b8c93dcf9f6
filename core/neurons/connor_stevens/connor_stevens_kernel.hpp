#pragma once

#include <cstddef>
#include <cstdint>

#include "core/neurons/connor_stevens/connor_stevens.hpp"
#include "core/neurons/step_call.hpp"
#include "core/simd/aligned_array.hpp"

namespace merkel {

/// The step of the five gates, by potential: x → p·x + q with p = e^{−dt/τ} and
/// q = x∞·(1−p). Both are taken from straight lines between potentials 1/16 mV apart, which is
/// within 1e-5 of the exact step; outside −120 … 80 mV the outermost values hold.
class GateTable {
 public:
  static constexpr double kLowest_mV = -120.0;
  static constexpr double kHighest_mV = 80.0;
  static constexpr double kPer_mV = 16.0;
  static constexpr std::size_t kGates = 5;         ///< m, h, n, a, b
  static constexpr std::size_t kRow = 4 * kGates;  ///< p, p's change to the next row, q, its change

  explicit GateTable(double step_ms);
  [[nodiscard]] const double* data() const noexcept { return values_.data(); }

 private:
  AlignedArray<double> values_;
};

/// Connor-Stevens neurons as structure of arrays, and what to do with them. All arrays are padded
/// to whole blocks.
struct ConnorStevensArguments {
  double* V = nullptr;
  double* gates[GateTable::kGates] = {};
  const double* input_begin = nullptr;       ///< µA/cm² at the first step's beginning
  const double* input_change = nullptr;      ///< by the last step's end
  const std::uint64_t* noise_key = nullptr;  ///< of each block's eight pairs of neurons
  StepCall call;
  double step_ms = 0.0;
  double noise_per_step = 0.0;  ///< σ·√dt
  /// Of the noise's variance: its share is (input − quiet)·share_per_input, within least … 1.
  double quiet_input = 0.0;
  double share_per_input = 0.0;
  double least_share = 1.0;
  const ConnorStevens* neuron = nullptr;
  const double* gate_table = nullptr;
  double resting_V_mV = 0.0;  ///< for neurons whose state turns non-finite
  double resting_gates[GateTable::kGates] = {};
};

/// Takes all steps: gates half a step away from the potential, by exact exponential steps; the
/// potential by Crank–Nicolson; then the noise. Bit-identical on every instruction set.
/// Real-time: yes.
void step_connor_stevens(const ConnorStevensArguments& arguments) noexcept;

}  // namespace merkel
