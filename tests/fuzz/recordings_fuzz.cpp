// Bytes of any kind as recordings of afferents (JSON). Built and run by fuzz.sh with libFuzzer.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "tools/studies/score/recordings.hpp"

// The program's own recordings, which a build puts here, are not asked for.
namespace merkel {
extern const char* const kPublishedRecordings;
const char* const kPublishedRecordings = "{}";
}  // namespace merkel

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace merkel;
  const auto recordings = parse_recordings({reinterpret_cast<const char*>(data), size}, "r.json");
  if (!recordings && recordings.error().sentence.empty()) std::abort();
  return 0;
}
