#pragma once

#include <array>
#include <ctime>
#include <string>

namespace merkel {

/// A time in UTC, in a format of std::strftime.
[[nodiscard]] inline std::string utc_text(std::time_t time, const char* format) {
  std::tm utc{};
  ::gmtime_r(&time, &utc);
  std::array<char, 64> text{};
  std::strftime(text.data(), text.size(), format, &utc);
  return text.data();
}

}  // namespace merkel
