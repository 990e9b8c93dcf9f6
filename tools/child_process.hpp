#pragma once

#include <string>
#include <vector>

namespace merkel {

/// A child process without standard input. The destructor ends it if it still runs.
class ChildProcess {
 public:
  enum class Output { kNone, kInherited };

  /// \param arguments  the program's name, searched in PATH, then its arguments
  explicit ChildProcess(const std::vector<std::string>& arguments, Output output = Output::kNone);
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  ~ChildProcess();

  /// True if the process could be started.
  [[nodiscard]] bool started() const noexcept { return process_ > 0; }
  /// Waits for the process to end. \return its exit code; −1 if it did not start or was killed
  int wait();

 private:
  int process_ = 0;
};

/// The path that starts this program again. The Python module sets it, once, before the program
/// runs: it is no program of its own.
[[nodiscard]] std::string& own_program();

}  // namespace merkel
