#pragma once

#include <string>
#include <string_view>

#include "core/expected.hpp"
#include "drivers/files/toml.hpp"

namespace merkel {

/// Returns the document without constructs that make toml++ misbehave, or the first such construct.
///
/// toml++ 3.3 and 3.4 test most characters outside quoted text for white space; for many characters
/// above U+007F ("é") the test is undefined behaviour. Valid TOML has such characters only in
/// quoted text and comments; elsewhere they are an error here. A space is inserted before each
/// opening quote, because the parser looks ahead for the end of a number ('1"é"'). The number of
/// parts of a dotted key is limited, because each part makes a table and tables are destroyed
/// recursively.
[[nodiscard]] Expected<std::string, TomlError> guard_toml(std::string_view text);

}  // namespace merkel
