// Arbitrary bytes as the files of a Phy folder, separated by "|". Built and run by fuzz.sh with
// libFuzzer.

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include <unistd.h>

#include "drivers/spike_files/spike_file.hpp"

namespace {

/// A folder of this process, removed at its end.
class Folder {
 public:
  Folder() { std::filesystem::create_directories(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  // In memory, because every input writes three files.
  std::string path_ = "/dev/shm/merkel-fuzz-phy-" + std::to_string(::getpid());
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace merkel;
  static const Folder folder;
  std::string_view rest(reinterpret_cast<const char*>(data), size);
  for (const char* const name : {"/params.py", "/spike_times.npy", "/spike_clusters.npy"}) {
    const std::string_view content = rest.substr(0, rest.find('|'));
    std::ofstream(folder.path() + name, std::ios::binary) << content;
    rest.remove_prefix(std::min(rest.size(), content.size() + 1));
  }
  const auto file = read_spike_file(folder.path());
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
