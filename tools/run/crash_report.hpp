#pragma once

#include <chrono>

#include "realtime/loop/loop_statistics.hpp"

namespace merkel {

/// From now on, a crash of the program (a wrong memory access, an abort, …) prints, before it ends
/// by its signal: the version and build id, which thread crashed, and how far the watched run had
/// come. Call once, first.
void install_crash_report();

/// While it lives, a crash tells how far the loop of these statistics had come. One at a time.
class CrashWatch {
 public:
  CrashWatch(const LoopStatistics& statistics, std::chrono::nanoseconds tick) noexcept;
  CrashWatch(const CrashWatch&) = delete;
  CrashWatch& operator=(const CrashWatch&) = delete;
  ~CrashWatch();
};

}  // namespace merkel
