#define TOML_IMPLEMENTATION
#include "tools/toml.hpp"

namespace merkel {

void throw_malformed_toml() { throw MalformedToml{}; }

}  // namespace merkel
