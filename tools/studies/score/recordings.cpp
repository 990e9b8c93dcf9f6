#include "tools/studies/score/recordings.hpp"

#include <utility>

#include "core/parameters/parameter_error.hpp"
#include "drivers/files/embedded_text.hpp"
#include "drivers/files/input_file.hpp"
#include "tools/studies/score/recorded_trials.hpp"

namespace merkel {

extern const std::span<const EmbeddedText> kPublishedRecordings;  ///< physiology.json

Expected<Recordings, SetupError> read_recordings(const std::string& path,
                                                 const ContactDecision::Parameters& contact) {
  constexpr std::size_t kLargest = std::size_t{1} << 20U;
  const auto text = read_whole_file(path, "data file", kLargest);
  if (!text) return Unexpected<SetupError>(text.error());
  auto recordings = parse_recordings(*text, path);
  if (!recordings) return recordings;
  const std::size_t slash = path.rfind('/');
  const std::string folder = slash == std::string::npos ? "" : path.substr(0, slash);
  if (auto loaded = load_trials(*recordings, folder, contact); !loaded) {
    return Unexpected<SetupError>(loaded.error());
  }
  return recordings;
}

Recordings published_recordings() {
  return parse_recordings(std::string(kPublishedRecordings.front().text), "physiology.json")
      .value();
}

Expected<Recordings, SetupError> recordings_named(const std::string& path,
                                                  const ContactDecision::Parameters& contact) {
  return path.empty() ? published_recordings() : read_recordings(path, contact);
}

}  // namespace merkel
