#pragma once

#include <optional>
#include <string>
#include <vector>

#include "realtime/pipeline.hpp"
#include "tools/run/terminal_line.hpp"

namespace merkel {

/// The fields of a status line: readings and state of the first probe, rates since the previous
/// call, and faults so far. The most important field comes first.
class StatusLine {
 public:
  [[nodiscard]] std::vector<std::string> fields(const RunProgress& now);

 private:
  std::optional<RunProgress> before_;
  ReadingBar bar_;
};

}  // namespace merkel
