#define TOML_IMPLEMENTATION
#include "drivers/files/toml.hpp"

#include "drivers/files/toml_guard.hpp"

namespace merkel {

void throw_malformed_toml() { throw MalformedToml{}; }

Expected<toml::table, TomlError> parse_toml(std::string_view text) {
  const auto guarded = guard_toml(text);
  if (!guarded) return Unexpected<TomlError>(guarded.error());
  try {
    return toml::parse(*guarded);
  } catch (const toml::parse_error& error) {
    return Unexpected<TomlError>({.line = static_cast<std::uint32_t>(error.source().begin.line),
                                  .reason = std::string(error.description())});
  } catch (const MalformedToml&) {
    return Unexpected<TomlError>({.line = 1, .reason = "the name of a [table] is malformed"});
  }
}

}  // namespace merkel
