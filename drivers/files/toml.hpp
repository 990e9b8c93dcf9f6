#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/expected.hpp"

namespace merkel {

/// Thrown where toml++ would assert: its parser reaches some assertions with malformed text ("[#"),
/// and relies on them in a release build. parse_toml() turns it into an error.
struct MalformedToml {};

[[noreturn]] void throw_malformed_toml();

}  // namespace merkel

// TOML_ASSERT is the library's own setting, which it takes only where NDEBUG is not defined.
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

/// Parses a TOML document of any content; no text can crash it. Two things that TOML allows are
/// refused: a dotted key of more than 16 parts, and a non-ASCII character right after the white
/// space that a backslash at the end of a line trims.
/// Real-time: no. Thread: any.
[[nodiscard]] Expected<toml::table, TomlError> parse_toml(std::string_view text);

/// The content of a TOML file of at most 1 MiB. `what` names its kind in errors: "scene".
[[nodiscard]] Expected<std::string, SetupError> read_toml_text(const std::string& path,
                                                               const std::string& what);

}  // namespace merkel
