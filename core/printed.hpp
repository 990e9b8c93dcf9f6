#pragma once

#include <string>

namespace merkel {

/// A text as std::printf prints it, of up to 511 bytes. Allocates.
[[nodiscard, gnu::format(printf, 1, 2)]] std::string printed(const char* format, ...);

}  // namespace merkel
