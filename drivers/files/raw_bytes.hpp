#pragma once

#include <string>
#include <type_traits>

namespace merkel {

/// Appends the bytes of a number or enumerator, in the order of this machine (little-endian on all
/// supported).
template <class T>
requires(std::is_arithmetic_v<T> || std::is_enum_v<T>) void append_raw(std::string& bytes,
                                                                       T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace merkel
