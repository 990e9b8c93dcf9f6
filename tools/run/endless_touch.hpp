#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "realtime/run_report.hpp"

namespace merkel {

/// Nothing presses a probe for longer without letting go: its zero is wrong.
inline constexpr std::chrono::seconds kEndlessTouch{60};

/// Names the devices whose touch does not end, once in each such touch, while a run lasts.
class EndlessTouch {
 public:
  [[nodiscard]] std::vector<std::string> sentences(const RunProgress& progress) {
    std::vector<std::string> sentences;
    reported_.resize(progress.probes.size());
    for (std::size_t i = 0; i < reported_.size(); ++i) {
      const RunProgress::ProbeProgress& probe = progress.probes[i];
      const bool endless = probe.live && probe.touch >= kEndlessTouch;
      if (endless && !reported_[i]) {
        sentences.push_back(probe.name +
                            ": the contact has not ended for 60 s: if nothing touches the probe, "
                            "tare it (in the live page, or with merkel calibrate), or set [probe] "
                            "contact_N above its offset");
      }
      reported_[i] = endless;
    }
    return sentences;
  }

 private:
  std::vector<bool> reported_;  ///< by probe
};

}  // namespace merkel
