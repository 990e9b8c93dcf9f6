#pragma once

#include <vector>

#include "core/neurons/hodgkin_huxley/hodgkin_huxley.hpp"
#include "core/realtime_tag.hpp"

namespace merkel {

/// Where a neuron comes to rest under a constant current, for every current under which it does.
///
/// The steady I(V) of the membrane rises with V, so each current has one fixed point. It is stable
/// up to a Hopf bifurcation (8.4 µA/cm² with the default neuron); the table ends a little before,
/// so that nothing is ever taken for resting that could begin to fire by itself.
class RestingStates {
 public:
  struct State {
    double V = 0.0;
    Gates gates;
  };

  /// Real-time: no.
  explicit RestingStates(const HodgkinHuxley& neuron);

  /// Whether the table holds a current, µA/cm².
  [[nodiscard]] bool covers(double current) const noexcept {
    return current >= lowest_ && current <= highest_;
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
