#pragma once

#include <vector>

#include "core/neurons/hodgkin_huxley/hodgkin_huxley.hpp"
#include "core/realtime_tag.hpp"

namespace merkel {

/// The stable resting state of a neuron as a function of a constant current.
///
/// The steady I(V) of the membrane rises with V, so each current has one fixed point. It is stable
/// up to a Hopf bifurcation (8.4 µA/cm² with the default neuron). The table ends slightly below it,
/// so that no neuron that could start to fire counts as resting. With sodium blocked
/// (g_Na = 0) there is no bifurcation, and the table ends 200 mV above V_r.
class RestingStates {
 public:
  struct State {
    double V = 0.0;
    Gates gates;
  };

  /// Real-time: no.
  explicit RestingStates(const HodgkinHuxley& neuron);

  /// Whether the table contains a current, µA/cm². The table of a neuron without stable rest is
  /// empty.
  [[nodiscard]] bool covers(double current) const noexcept {
    return !states_.empty() && current >= lowest_ && current <= highest_;
  }
  /// The fixed point under a current that the table covers, to 1e-5 mV. Real-time: yes.
  [[nodiscard]] State at(double current) const noexcept MERKEL_REALTIME;
  /// The largest current in the table.
  [[nodiscard]] double highest() const noexcept { return highest_; }

 private:
  double lowest_ = 0.0;
  double highest_ = 0.0;
  double spacing_ = 1.0;
  std::vector<State> states_;
};

}  // namespace merkel
