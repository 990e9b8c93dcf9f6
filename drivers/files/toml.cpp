#define TOML_IMPLEMENTATION
#include "drivers/files/toml.hpp"

#include <cerrno>
#include <cstddef>
#include <cstring>
#include <fstream>

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

Expected<std::string, SetupError> read_toml_text(const std::string& path, const std::string& what) {
  constexpr std::size_t kLargest = std::size_t{1} << 20U;
  std::ifstream file(path, std::ios::binary);
  const std::string failure = "cannot read the " + what + " " + path + ": ";
  if (!file) return bad_input(failure + std::strerror(errno) + "; check the name");
  std::string text(kLargest + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (file.bad()) return bad_input(failure + "is it a regular file?");
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (text.size() > kLargest) {
    return bad_input(failure + "it is larger than 1 MiB; is it a recording?");
  }
  return text;
}

}  // namespace merkel
