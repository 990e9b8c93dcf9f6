#pragma once

/// toml++ as this project uses it; nobody else includes it.
///
/// Its parser asserts where text is malformed in ways it did not expect ("[#"), and in a release
/// build relies on that not happening. Here a failed assertion is an exception instead, so that no
/// text can do harm.
namespace merkel {

struct MalformedToml {};

[[noreturn]] void throw_malformed_toml();

}  // namespace merkel

#pragma push_macro("NDEBUG")
#undef NDEBUG
#define TOML_ASSERT(expression) ((expression) ? void() : ::merkel::throw_malformed_toml())
#define TOML_HEADER_ONLY 0
#include <toml++/toml.h>
#pragma pop_macro("NDEBUG")
