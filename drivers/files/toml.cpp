#define TOML_IMPLEMENTATION
#include "drivers/files/toml.hpp"

namespace merkel {

void throw_malformed_toml() { throw MalformedToml{}; }

}  // namespace merkel
