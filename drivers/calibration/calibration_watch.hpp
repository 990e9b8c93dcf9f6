#pragma once

#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "drivers/probe.hpp"

namespace merkel {

/// What a user is told of readings that their calibration does not cover. Thread: probe.
class CalibrationWatch {
 public:
  /// \param saturated  the sensor is at the end of its range: told at its start, at most once a
  /// second. \param outside  of the calibrated range: told once
  void take(bool saturated, bool outside, std::chrono::nanoseconds time, const ProbeInfo& probe,
            std::vector<std::string>& notices) {
    if (saturated && !saturated_ && time >= again_) {
      notices.push_back(probe.name + ": the sensor is at the end of its range");
      again_ = time + kPause;
    }
    saturated_ = saturated;
    if (outside && !std::exchange(outside_noted_, true)) {
      notices.push_back(probe.name + ": the press is outside the calibrated range of " +
                        probe.calibration_file);
    }
  }

 private:
  static constexpr std::chrono::seconds kPause{1};

  bool saturated_ = false;
  bool outside_noted_ = false;
  std::chrono::nanoseconds again_{
      std::chrono::nanoseconds::min()};  ///< when saturation may be told
};

}  // namespace merkel
