#pragma once

#include <string>
#include <utility>
#include <vector>

namespace merkel {

extern const char* const kGitHash;  ///< of the sources, "-dirty" if changed; "unknown" outside git

/// The machine as recorded in a session, by name: kernel, whether it is a real-time kernel,
/// processors and instruction set, and the boot (equal in two sessions: their times are of one
/// clock).
[[nodiscard]] std::vector<std::pair<std::string, std::string>> machine_facts();
/// If the machine's clock is synchronised: the largest error of UTC (`utc_error_ns`) and who
/// reports it (`utc_error_source`). For runs in real time; may take a second.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> utc_facts();

}  // namespace merkel
