#pragma once

#include <cstdint>
#include <string_view>

#include "realtime/pipeline.hpp"

namespace merkel {

/// Notifies systemd if it started this program as a service of Type=notify (sd_notify(3)): ready
/// when ticks are simulated, then alive as long as more ticks follow. Does nothing without systemd.
/// Thread: one.
class ServiceNotice {
 public:
  /// Called about once a second.
  void progress(const RunCounters& counters);

 private:
  std::uint64_t ticks_ = 0;  ///< simulated or skipped, at the last call
  bool ready_ = false;
};

}  // namespace merkel
