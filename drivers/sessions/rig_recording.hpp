#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/expected.hpp"
#include "drivers/clock/clock_line.hpp"
#include "drivers/sessions/session_chunk.hpp"
#include "drivers/sessions/xdf_file.hpp"

namespace merkel {

/// What the sink lsl: calls its streams. Their source is kRigSource and their name.
inline constexpr std::string_view kRigSource = "merkel-";
/// The mark that ends a run, at the last instant of its streams. liblsl may send one more sample of
/// stale content when an outlet closes, which is therefore later.
inline constexpr std::string_view kRigEnd = "merkel: end of run";

/// The parts of FILE@RIG. If FILE@RIG is itself a file, there is no rig.
[[nodiscard]] std::pair<std::string, std::string> split_rig(const std::string& path);

/// One rig in a recording of LabRecorder: the streams that its sink lsl: sent, with their times on
/// the recorder's clock. It has spikes, samples and marks, but no ticks.
class RigRecording {
 public:
  /// Finds the streams. False if the file has none of merkel. Fails if it has several rigs and none
  /// is chosen. The file is at its first chunk afterwards. \param rig  empty: the only one
  [[nodiscard]] Expected<bool, SetupError> read(XdfFile& file, std::string_view rig);

  /// Those of the run, which its spikes' description has; `rig`; the start on the recorder's clock.
  [[nodiscard]] const std::vector<std::pair<std::string, std::string>>& facts() const noexcept {
    return facts_;
  }
  /// Decodes samples of a stream, without its number. Streams of others are skipped. False if the
  /// bytes are not samples of the stream.
  [[nodiscard]] bool decode(std::uint32_t stream, std::string_view content, SessionChunk& chunk);

 private:
  struct Stream {
    enum class Kind : std::uint8_t { kSpikes, kSamples, kMarks };
    Kind kind = Kind::kSpikes;
    XdfStream samples = {};
    std::uint32_t probe = 0;
    std::vector<std::string> labels = {};
    ClockLine clock = {};
    std::uint32_t sequence = 0;
  };
  struct Found;

  Expected<void, SetupError> take(const std::map<std::uint32_t, Found>& found,
                                  const std::string& rig);
  void decode_row(Stream& stream, std::chrono::nanoseconds time, std::string_view row,
                  SessionChunk& chunk) const;
  [[nodiscard]] bool is_stale(double stamp_s) const;

  std::map<std::uint32_t, Stream> streams_;
  std::vector<std::pair<std::string, std::string>> facts_;
  std::vector<std::uint16_t> patches_;  ///< by neuron, from 0
  std::vector<double> ends_s_;          ///< of the rig's runs, on its clock
};

}  // namespace merkel
