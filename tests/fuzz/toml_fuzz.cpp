// Arbitrary bytes as TOML. Built and run by fuzz.sh with libFuzzer.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "drivers/files/toml.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace merkel;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto table = parse_toml(text);
  if (!table) return table.error().reason.empty() ? std::abort(), 0 : 0;
  if (table->size() > size) std::abort();
  return 0;
}
