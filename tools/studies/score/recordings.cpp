#include "tools/studies/score/recordings.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <utility>

#include "core/parameters/parameter_error.hpp"
#include "tools/studies/score/recorded_trials.hpp"

namespace merkel {

/// The text of tools/studies/score/physiology.json, built into the program.
extern const char* const kPublishedRecordings;

Expected<Recordings, SetupError> read_recordings(const std::string& path) {
  constexpr std::size_t kLargest = std::size_t{1} << 20U;
  std::ifstream file(path, std::ios::binary);
  if (!file) return bad_input("cannot read the data file " + path + ": " + std::strerror(errno));
  std::string text(kLargest + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (file.bad()) return bad_input("cannot read the data file " + path + ": is it a regular file?");
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (text.size() > kLargest) return bad_input(path + " is larger than 1 MiB: is it a data file?");
  auto recordings = parse_recordings(text, path);
  if (!recordings) return recordings;
  const std::size_t slash = path.rfind('/');
  const std::string folder = slash == std::string::npos ? "" : path.substr(0, slash);
  if (auto loaded = load_trials(*recordings, folder); !loaded) {
    return Unexpected<SetupError>(loaded.error());
  }
  return recordings;
}

Recordings published_recordings() {
  return parse_recordings(kPublishedRecordings, "physiology.json").value();
}

Expected<Recordings, SetupError> recordings_named(const std::string& path) {
  return path.empty() ? published_recordings() : read_recordings(path);
}

}  // namespace merkel
