#pragma once

#include <string>
#include <string_view>

#include "core/expected.hpp"
#include "drivers/files/toml.hpp"

namespace merkel {

/// Returns the document without anything that makes toml++ misbehave, or the first such thing.
///
/// toml++ 3.3 and 3.4 ask of most characters outside quoted text whether they are white space, and
/// the answer is undefined behaviour for many above U+007F ("é"). Valid TOML has such characters in
/// quoted text and comments alone; anywhere else they are an error here. A space goes before each
/// opening quote, because the parser looks ahead for the end of a number ('1"é"'). A dotted key
/// makes a table for each part, and tables are destroyed recursively, so the parts are limited.
[[nodiscard]] Expected<std::string, TomlError> guard_toml(std::string_view text);

}  // namespace merkel
