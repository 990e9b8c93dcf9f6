#pragma once

#include <string>
#include <vector>

#include <spawn.h>

#include "tests/temporary_folder.hpp"

namespace merkel {

/// The result of a run of the program.
struct ProgramRun {
  int exit_code = -1;  ///< −1 if ended by a signal
  int ended_by = 0;    ///< the signal
  std::string out;
  std::string err;
  double peak_memory_MiB = 0.0;  ///< sampled once a millisecond
};

/// The built program merkel, running with arguments in the source folder.
class StartedProgram {
 public:
  explicit StartedProgram(const std::vector<std::string>& arguments);
  void send(int signal) const;
  /// Waits for its end.
  ProgramRun finish();

 private:
  TemporaryFolder folder_;
  int process_ = 0;
};

/// Starts the built program merkel with arguments. \return its number; 0 if it did not start
int spawn_program(const std::vector<std::string>& arguments,
                  const posix_spawn_file_actions_t& actions);

/// Runs the built program merkel with arguments, in the source folder, and waits for its end.
ProgramRun run_program(const std::vector<std::string>& arguments);

}  // namespace merkel
