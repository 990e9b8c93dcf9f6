#pragma once

#include <cstddef>

#include "core/neurons/hodgkin_huxley/hodgkin_huxley_group.hpp"
#include "core/worker_team.hpp"
#include "tools/studies/bench/measure.hpp"

namespace merkel {

/// A network to time. All neurons fire, driven by 8 to 14 µA/cm².
struct PopulationCase {
  std::size_t neurons = 20;
  IntegrationMethod method = IntegrationMethod::kCrankNicolson;
  Precision precision = Precision::kDouble;
  double step_us = 25.0;
  bool coupled = false;
  WorkerTeam* team = nullptr;
};

/// Time of one membrane step of one neuron, s.
[[nodiscard]] Measurement neuron_step_cost(const PopulationCase& which, int runs = 7,
                                           double run_s = 0.02);

/// The lower bound of the time per neuron and step of the default method without a network, s: the
/// multiplications and multiply-adds of the compiled kernel (counted by port_bound.py) over the
/// measured rate of multiply-adds of this core.
[[nodiscard]] double port_bound_s(Precision precision, double fma_peak_gflops);

/// Arithmetic operations per neuron and step of the default method without a network. A fused
/// multiply-add counts as two, a division as one; comparisons and selections do not count.
[[nodiscard]] constexpr double operations_of_neuron_step(Precision precision) noexcept {
  // w 1; b by a polynomial in w (9 or 5 multiply-adds); its powers 8; p, D, s of three gates 19;
  // new values by one division 25; channels 12; current, imbalance and potential 9.
  return (precision == Precision::kDouble ? 18.0 : 10.0) + 1.0 + 8.0 + 19.0 + 25.0 + 12.0 + 9.0;
}

}  // namespace merkel
