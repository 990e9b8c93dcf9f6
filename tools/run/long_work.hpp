#pragma once

#include <chrono>
#include <string>
#include <thread>

#include "realtime/run_report.hpp"

namespace merkel {

/// Prints a sentence to stderr if work takes longer than expected, before it is over.
class LongWork {
 public:
  /// \param sentence  what takes so long, and why
  explicit LongWork(std::string sentence,
                    std::chrono::milliseconds patience = std::chrono::seconds{1});

 private:
  std::jthread thread_;  ///< stopped and joined by its destructor
};

/// Reports a long run on a virtual clock where no status line shows it: after 5 s, 10 s, 20 s, …,
/// with the time that the samples known so far will take.
class LongRun {
 public:
  void report(const RunProgress& progress);

 private:
  std::chrono::nanoseconds next_ = std::chrono::seconds{5};
};

}  // namespace merkel
