#pragma once

#include <string>

#include "core/expected.hpp"

namespace merkel {

/// Exit codes of the program.
inline constexpr int kDone = 0;
inline constexpr int kFailed = 1;      ///< while running
inline constexpr int kWrongInput = 2;  ///< or wrong usage
inline constexpr int kRefused = 3;     ///< by a device or the host

/// Prints "merkel: sentence" to stderr. Returns the exit code of wrong input: 2.
int refuse(const std::string& sentence);
/// The same for a set-up error. \return 2 or 3, depending on the kind of error
int refuse(const SetupError& error);
/// The same for a failure at run time. \return 1
int fail(const std::string& sentence);
/// Prints "merkel: sentence" to stderr, and the command goes on.
void warn(const std::string& sentence);
/// Writes what standard output still buffers. \return the exit code; 1 where it was 0 and output is
/// lost: printed with the reason, except for a reader that has closed its pipe
int after_output(int exit_code);

}  // namespace merkel
