#pragma once

#include <string_view>

namespace merkel {

/// The missing library in messages of a merkel that was built without liblsl.
inline constexpr std::string_view kLslLibrary =
    "liblsl, which Debian does not have: in a clone of merkel, run tools/install_liblsl";

}  // namespace merkel
