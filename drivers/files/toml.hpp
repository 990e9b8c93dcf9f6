#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/expected.hpp"

namespace merkel {

/// Thrown instead of a toml++ assertion. Malformed text ("[#") triggers some assertions of its
/// parser, which relies on them in a release build. parse_toml() converts the exception to an
/// error.
struct MalformedToml {};

[[noreturn]] void throw_malformed_toml();

}  // namespace merkel

// TOML_ASSERT is the library's own setting, which it accepts only if NDEBUG is not defined.
#pragma push_macro("NDEBUG")
#undef NDEBUG
#define TOML_ASSERT(expression) ((expression) ? void() : ::merkel::throw_malformed_toml())
#define TOML_HEADER_ONLY 0
#include <toml++/toml.h>
#pragma pop_macro("NDEBUG")

namespace merkel {

struct TomlError {
  std::uint32_t line = 0;  ///< from 1
  std::string reason;
};

/// Parses a TOML document; safe for any input. Refuses two constructs that TOML allows: a dotted
/// key of more than 16 parts, and a non-ASCII character directly after the white space that a
/// backslash at the end of a line trims.
/// Real-time: no. Thread: any.
[[nodiscard]] Expected<toml::table, TomlError> parse_toml(std::string_view text);

/// The largest TOML file that is read.
inline constexpr std::size_t kMaxTomlBytes = std::size_t{1} << 20U;

}  // namespace merkel
