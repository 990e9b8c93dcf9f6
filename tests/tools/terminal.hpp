#pragma once

#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "tests/tools/program.hpp"

namespace merkel {

/// The built program at a terminal of some width: stdin and stderr are the terminal.
class TerminalProgram {
 public:
  TerminalProgram(const std::vector<std::string>& arguments, unsigned short columns);
  TerminalProgram(const TerminalProgram&) = delete;
  TerminalProgram& operator=(const TerminalProgram&) = delete;
  ~TerminalProgram();

  /// Waits until the terminal has shown a text; false after ten seconds without it.
  bool wait_for(const std::string& text);
  void type(const std::string& text) const;
  /// Waits for the program's end; `err` is everything that the terminal has shown.
  ProgramRun finish();

 private:
  [[nodiscard]] std::string shown();

  TemporaryFolder folder_;
  int master_ = -1;
  int process_ = 0;
  std::mutex mutex_;
  std::string shown_;  ///< guarded by mutex_
  std::jthread reader_;
};

}  // namespace merkel
