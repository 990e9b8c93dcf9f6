#pragma once

#include <optional>
#include <string>
#include <vector>

#include "realtime/pipeline.hpp"
#include "tools/run/terminal_line.hpp"

namespace merkel {

/// The fields of one line about a run: what the first probe reads, what it is doing, rates of the
/// time since the call before, and what went wrong so far. What matters most comes first.
class StatusLine {
 public:
  [[nodiscard]] std::vector<std::string> fields(const RunProgress& now);

 private:
  std::optional<RunProgress> before_;
  ReadingBar bar_;
};

}  // namespace merkel
