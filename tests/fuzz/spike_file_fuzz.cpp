// Bytes of any kind as a file of spikes: CSV or a session. Built and run by fuzz.sh with
// libFuzzer.

#include <cstddef>
#include <cstdint>

#include "tests/fuzz/check_spikes.hpp"
#include "tests/fuzz/memory_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace merkel;
  static MemoryFile memory;
  check_spikes(memory.hold(data, size), size);
  return 0;
}
