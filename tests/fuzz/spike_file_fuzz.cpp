// Bytes of any kind as a file of spikes: CSV, GDF or a session. Built and run by fuzz.sh with
// libFuzzer.

#include <algorithm>
#include <cstdlib>

#include "drivers/spike_files/spike_file.hpp"
#include "tests/fuzz/memory_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace merkel;
  static MemoryFile memory;
  const auto file = read_spike_file(memory.hold(data, size));
  if (!file) {
    if (file.error().sentence.empty()) std::abort();
    return 0;
  }
  if (file->spikes.size() > size) std::abort();
  if (!std::is_sorted(file->spikes.begin(), file->spikes.end())) std::abort();
  for (const RecordedSpike& spike : file->spikes) {
    if (spike.neuron == 0) std::abort();
  }
  return 0;
}
