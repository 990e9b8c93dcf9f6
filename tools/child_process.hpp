#pragma once

#include <string>
#include <vector>

namespace merkel {

/// Another program, run without input. Ended with this object if it has not by itself.
class ChildProcess {
 public:
  enum class Output { kNone, kInherited };

  /// \param arguments  the program's name first, looked for in the PATH
  explicit ChildProcess(const std::vector<std::string>& arguments, Output output = Output::kNone);
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  ~ChildProcess();

  /// Whether it could be started.
  [[nodiscard]] bool started() const noexcept { return process_ > 0; }
  /// Waits for its end. \return its exit code; −1 where it was not started or was killed
  int wait();

 private:
  int process_ = 0;
};

}  // namespace merkel
