#pragma once

#include <string_view>

namespace merkel {

/// What is missing where merkel was built without liblsl, for messages.
inline constexpr std::string_view kLslLibrary =
    "liblsl, which Debian does not have: install a package from "
    "https://github.com/sccn/liblsl/releases";

}  // namespace merkel
