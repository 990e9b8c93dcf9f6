#pragma once

#include <string>
#include <vector>

namespace merkel {

/// The kinds of examples that come with the program, in share/merkel beside it.
enum class Example { kScene, kTrace };

/// The names of all examples, sorted; empty where they are not installed. Thread: any.
[[nodiscard]] std::vector<std::string> example_names(Example kind);

/// `path`, or that of the example of this name if no such file exists and it has no folder or
/// extension. Thread: any.
[[nodiscard]] std::string path_or_example(Example kind, const std::string& path);

}  // namespace merkel
