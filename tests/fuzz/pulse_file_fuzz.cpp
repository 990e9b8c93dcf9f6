// Arbitrary bytes as a file of pulses: times or a session or, with "|" between them, the files of
// an Open Ephys line. Built and run by fuzz.sh with libFuzzer.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "drivers/spike_files/pulse_file.hpp"
#include "tests/fuzz/memory_file.hpp"
#include "tests/fuzz/memory_folder.hpp"

namespace {

/// \param most  no input of this size holds more pulses
void check_pulses(const std::string& path, std::size_t most) {
  const auto file = merkel::read_pulse_file(path);
  if (!file) {
    if (file.error().sentence.empty()) std::abort();
    return;
  }
  std::size_t count = 0;
  for (const auto& [line, times] : file->lines) {
    if (!std::is_sorted(times.begin(), times.end())) std::abort();
    count += times.size();
  }
  if (count > most) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace merkel;
  static MemoryFile memory;
  static const MemoryFolder folder("pulses");
  check_pulses(memory.hold(data, size), size);
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  if (bytes.find('|') == std::string_view::npos) return 0;
  folder.hold(bytes, {"/states.npy", "/timestamps.npy", "/structure.oebin"});
  check_pulses(folder.path(), size);
  return 0;
}
