#pragma once

#include <functional>
#include <vector>

namespace merkel::reference {

/// The paper's membranes (Hodgkin-Huxley with an L-type calcium term, leak rebalanced): an
/// independent implementation, solved with SUNDIALS CVODE (BDF, dense Newton, root finding at the
/// spike threshold).
struct CvodeMembranes {
  int neurons = 1;
  double g_CaL = 0.1;
  double relative_tolerance = 1e-10;
  double absolute_tolerance = 1e-12;
  /// Injected current, µA/cm², of a neuron (from 0) at a time in ms.
  std::function<double(int, double)> current;
  /// Times in ms at which the current is not smooth: the solver restarts there.
  std::vector<double> corners;
  /// Coupling: conductance[i][j] in mS/cm², symmetric; empty for none.
  std::vector<std::vector<double>> coupling;

  struct Spike {
    int neuron;
    double time_ms;
  };
  /// Upward crossings of −20 mV from rest at 0 until `end_ms`, in order of time.
  [[nodiscard]] std::vector<Spike> spikes_until(double end_ms) const;
};

}  // namespace merkel::reference
