#pragma once

#include <string>
#include <utility>
#include <vector>

namespace merkel {

extern const char* const kGitHash;  ///< of the sources, "-dirty" if changed; "unknown" outside git

/// The machine as recorded in a session, by name: kernel, whether it is a real-time kernel,
/// processors and instruction set, the boot (equal in two sessions: their times are of one clock)
/// and, if its clock is synchronised, the largest error of UTC (`utc_error_ns`).
[[nodiscard]] std::vector<std::pair<std::string, std::string>> machine_facts();

}  // namespace merkel
