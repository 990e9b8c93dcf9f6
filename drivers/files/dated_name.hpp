#pragma once

#include <chrono>
#include <string>
#include <vector>

namespace merkel {

/// A file name in which "%t" stands for the time: "s-%t.xdf" becomes "s-20260131T120000.xdf" (UTC).
/// A name without "%t" stays as it is.
[[nodiscard]] std::string dated_name(const std::string& pattern,
                                     std::chrono::system_clock::time_point now);

/// The finished names of files of such a pattern whose NAME.part lies there, in order: what runs
/// that were killed have left, or runs that go on. Empty for a name without "%t".
[[nodiscard]] std::vector<std::string> unfinished_names(const std::string& pattern);

}  // namespace merkel
