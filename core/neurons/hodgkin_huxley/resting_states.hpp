#pragma once

#include <vector>

#include "core/neurons/hodgkin_huxley/hodgkin_huxley.hpp"
#include "core/realtime_tag.hpp"

namespace merkel {

/// The resting state of a neuron under a constant current, for each current that has a stable one.
///
/// The steady I(V) of the membrane rises with V, so each current has one fixed point. It is stable
/// up to a Hopf bifurcation (8.4 µA/cm² with the default neuron); the table ends a little before,
/// so that no neuron counts as resting that could begin to fire by itself. With sodium blocked
/// (g_Na = 0) there is no bifurcation, and the table ends 200 mV above V_r.
class RestingStates {
 public:
  struct State {
    double V = 0.0;
    Gates gates;
  };

  /// Real-time: no.
  explicit RestingStates(const HodgkinHuxley& neuron);

  /// Whether the table holds a current, µA/cm². A neuron without a stable rest has none.
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
