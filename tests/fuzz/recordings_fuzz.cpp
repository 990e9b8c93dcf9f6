// Arbitrary bytes as recordings of afferents (JSON). Built and run by fuzz.sh with libFuzzer.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "tools/studies/score/recordings.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace merkel;
  const auto recordings = parse_recordings({reinterpret_cast<const char*>(data), size}, "r.json");
  if (!recordings && recordings.error().sentence.empty()) std::abort();
  return 0;
}
