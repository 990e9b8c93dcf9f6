// Arbitrary bytes as the files of a Phy folder, separated by "|". Built and run by fuzz.sh with
// libFuzzer.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include <unistd.h>

#include "tests/fuzz/check_spikes.hpp"

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
  check_spikes(folder.path(), size);
  return 0;
}
