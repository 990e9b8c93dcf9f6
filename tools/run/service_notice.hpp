#pragma once

#include <cstdint>
#include <string_view>

#include "realtime/pipeline.hpp"

namespace merkel {

/// Tells systemd, where it started this program as a service of Type=notify, that the run goes on
/// (sd_notify(3)): ready once ticks are simulated, then alive as long as more of them are. Without
/// systemd nothing happens. Thread: one.
class ServiceNotice {
 public:
  /// Called about once a second.
  void progress(const RunCounters& counters);

 private:
  std::uint64_t ticks_ = 0;  ///< simulated or skipped, at the last call
  bool ready_ = false;
};

}  // namespace merkel
