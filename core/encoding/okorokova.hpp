#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <vector>

#include "core/realtime_tag.hpp"

namespace merkel {

/// Response of the afferents of a whole hand to a press on one fingertip.
struct PopulationResponse {
  double rate_Hz = 0.0;    ///< spikes of all afferents
  double recruited = 0.0;  ///< afferents that fire
};

/// The linear models of Okorokova, He & Bensmaia 2018, "Biomimetic encoding model for restoring
/// touch in bionic hands through a nerve interface" (J Neural Eng 15:066033), with the coefficients
/// that the FeedbackDecode software of the University of Utah uses. They were fitted to presses of
/// 0 to 3 mm. Real-time: yes.
/// \param depth_mm  now and 33, 66 and 99 ms before
[[nodiscard]] PopulationResponse okorokova_response(const std::array<double, 4>& depth_mm) noexcept
    MERKEL_REALTIME;

/// A reading of a touch, its depth or its force, at every tick of the last 99 ms. Real-time: yes,
/// after construction.
class TouchHistory {
 public:
  static constexpr std::chrono::milliseconds kInterval{33};

  explicit TouchHistory(std::chrono::nanoseconds tick);

  /// Restarts as if the reading had always been `value`.
  void reset(double value) noexcept MERKEL_REALTIME;
  void push(double value) noexcept MERKEL_REALTIME;
  /// At the last tick and 33, 66 and 99 ms before, to the nearest tick.
  [[nodiscard]] std::array<double, 4> at_intervals() const noexcept MERKEL_REALTIME;

 private:
  std::array<std::size_t, 4> lags_;  ///< ticks
  std::vector<double> values_;       ///< ring buffer
  std::size_t newest_ = 0;
};

}  // namespace merkel
