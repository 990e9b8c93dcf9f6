#pragma once

#include <bit>
#include <string>
#include <type_traits>

namespace merkel {

// The files and frames that hold such bytes are little-endian.
static_assert(std::endian::native == std::endian::little);

/// Appends the bytes of a number or enumerator.
template <class T>
requires(std::is_arithmetic_v<T> || std::is_enum_v<T>) void append_raw(std::string& bytes,
                                                                       T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace merkel
