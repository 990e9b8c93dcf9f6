// Arbitrary bytes as a file of stimulation commands (CSV). Built and run by fuzz.sh with libFuzzer.

#include <algorithm>
#include <cstdlib>

#include "drivers/spike_files/stimulation_file.hpp"
#include "tests/fuzz/memory_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace merkel;
  static MemoryFile memory;
  const std::string& path = memory.hold(data, size);
  const bool recognised = is_stimulation_csv(path);
  const auto file = read_stimulation_csv(path);
  if (!file) {
    if (file.error().sentence.empty()) std::abort();
    return 0;
  }
  // A file without a header is read only if it has no commands.
  if (!recognised && !file->commands.empty()) std::abort();
  if (file->commands.size() > size) std::abort();
  if (!std::is_sorted(file->commands.begin(), file->commands.end(),
                      [](const auto& a, const auto& b) { return a.time < b.time; })) {
    std::abort();
  }
  for (const RecordedCommand& command : file->commands) {
    if (command.electrode.empty()) std::abort();
  }
  return 0;
}
