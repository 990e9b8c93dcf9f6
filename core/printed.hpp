#pragma once

#include <string>

namespace merkel {

/// A text as std::printf prints it. Allocates.
[[nodiscard, gnu::format(printf, 1, 2)]] std::string printed(const char* format, ...);

}  // namespace merkel
