#pragma once

#include <chrono>

#include "realtime/loop/loop_statistics.hpp"

namespace merkel {

/// Installs a handler: if the program crashes (an invalid memory access, an abort, …), it prints
/// version, build id, the name of the thread and the progress of the watched run, then ends by the
/// signal. Call once, first.
void install_crash_report();

/// During its lifetime, a crash report includes the progress of this loop. One object at a time.
class CrashWatch {
 public:
  CrashWatch(const LoopStatistics& statistics, std::chrono::nanoseconds tick) noexcept;
  CrashWatch(const CrashWatch&) = delete;
  CrashWatch& operator=(const CrashWatch&) = delete;
  ~CrashWatch();
};

}  // namespace merkel
