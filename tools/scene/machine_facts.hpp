#pragma once

#include <string>
#include <utility>
#include <vector>

namespace merkel {

extern const char* const kGitHash;  ///< of the sources, "-dirty" if changed; "unknown" outside git

/// What a session notes about the machine: kernel, whether it is a real-time kernel, processors and
/// the instruction set used, by name.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> machine_facts();

}  // namespace merkel
