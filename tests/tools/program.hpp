#pragma once

#include <string>
#include <vector>

namespace merkel {

/// What a run of the program left behind.
struct ProgramRun {
  int exit_code = -1;  ///< −1 when it was ended by a signal
  std::string out;
  std::string err;
  double peak_memory_MiB = 0.0;
};

/// Runs the built program merkel with arguments, in the source folder, and waits for its end.
ProgramRun run_program(const std::vector<std::string>& arguments);

}  // namespace merkel
