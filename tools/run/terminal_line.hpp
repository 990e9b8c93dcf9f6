#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/records/tick_record.hpp"

namespace merkel {

/// The last line of a terminal, kept up to date while sentences scroll above it. Prints only the
/// sentences if stderr is not a terminal. Thread: one.
class TerminalLine {
 public:
  TerminalLine();
  TerminalLine(const TerminalLine&) = delete;
  TerminalLine& operator=(const TerminalLine&) = delete;
  ~TerminalLine() { clear(); }

  [[nodiscard]] bool on_terminal() const noexcept { return on_terminal_; }
  /// Shows as many of the fields as fit, the first ones first.
  void show(const std::vector<std::string>& fields);
  /// Prints a line above it.
  void print_line(const std::string& sentence);
  /// Prints what a probe reports about its device.
  void print_notices(const std::vector<std::string>& notices);
  void clear();

 private:
  bool on_terminal_;
  std::string shown_;
};

/// Fields joined by two spaces, as many as fit into `columns`; the first is cut if it must be.
[[nodiscard]] std::string fit_line(const std::vector<std::string>& fields, std::size_t columns);

/// The present reading of a probe.
struct LiveReading {
  std::optional<double> force_N;
  std::optional<double> depth_mm;
};

/// "0.321 N 1.02 mm [####    ]": the bar is of the largest reading so far.
class ReadingBar {
 public:
  [[nodiscard]] std::string text(const LiveReading& reading);

 private:
  double largest_ = 0.0;
};

}  // namespace merkel
