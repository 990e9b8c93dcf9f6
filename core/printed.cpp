#include "core/printed.hpp"

#include <array>
#include <cstdarg>
#include <cstdio>

namespace merkel {

std::string printed(const char* format, ...) {
  std::array<char, 512> text{};
  std::va_list values;
  va_start(values, format);
  std::vsnprintf(text.data(), text.size(), format, values);
  va_end(values);
  return text.data();
}

}  // namespace merkel
