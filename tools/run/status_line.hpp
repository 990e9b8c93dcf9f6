#pragma once

#include <optional>
#include <string>

#include "realtime/pipeline.hpp"

namespace merkel {

/// One line about the last second of a run: rates, latencies, and what went wrong so far.
class StatusLine {
 public:
  /// "12 s  1000 samples/s  0 late  …", of what happened since the call before.
  [[nodiscard]] std::string text(const RunProgress& now);

 private:
  std::optional<RunProgress> before_;
};

}  // namespace merkel
