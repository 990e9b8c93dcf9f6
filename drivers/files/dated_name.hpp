#pragma once

#include <chrono>
#include <string>
#include <vector>

namespace merkel {

/// Replaces "%t" in a file name by the time: "s-%t.xdf" becomes "s-20260131T120000.xdf" (UTC). A
/// name without "%t" is unchanged.
[[nodiscard]] std::string dated_name(const std::string& pattern,
                                     std::chrono::system_clock::time_point now);

/// The final names of all existing NAME.part files of such a pattern, in order: left by killed
/// runs, or in use by current ones. Empty for a name without "%t".
[[nodiscard]] std::vector<std::string> unfinished_names(const std::string& pattern);

}  // namespace merkel
