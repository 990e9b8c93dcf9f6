#pragma once

#include <cstdint>
#include <initializer_list>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/expected.hpp"
#include "drivers/clock/clock_map.hpp"
#include "drivers/sessions/rig_recording.hpp"
#include "drivers/sessions/session_chunk.hpp"
#include "drivers/sessions/session_format.hpp"
#include "drivers/sessions/session_items.hpp"
#include "drivers/sessions/xdf_file.hpp"
#include "drivers/sink.hpp"

namespace pugi {
class xml_node;
}

namespace merkel {

/// Reads a recorded session, chunk by chunk, in bounded memory.
///
/// A session that broke off is read up to its last whole chunk. Whatever the file's bytes are,
/// every item handed out has a valid state and kind and finite, plausible values, but for the extra
/// columns of samples, which may be any number; anything else is an error that names the place.
/// Streams that are not merkel's are skipped.
class SessionReader {
 public:
  /// \param path  FILE; of a recording of LabRecorder with several rigs, FILE\@RIG (RigRecording)
  [[nodiscard]] static Expected<SessionReader, SetupError> open(const std::string& path);

  [[nodiscard]] const std::string& path() const noexcept { return path_; }
  /// A fact of the recording (scene text, seeds, machine) by name; empty if absent.
  [[nodiscard]] std::string fact(std::string_view name) const;
  /// All facts, names and values, in order.
  [[nodiscard]] const std::vector<std::pair<std::string, std::string>>& facts() const noexcept {
    return facts_;
  }
  /// Names of DeliveredSample::further of the samples, in order.
  [[nodiscard]] const std::vector<std::string>& extra_columns() const noexcept {
    return extra_columns_;
  }
  /// Whether the samples have ProbeSample::valid_for; those of older versions do not.
  [[nodiscard]] bool has_validity() const noexcept { return has_validity_; }
  /// All of that name, in order.
  [[nodiscard]] std::vector<std::string> facts(std::string_view name) const;

  /// From now on decodes only these streams, besides marks and readings of clocks.
  void read_only(std::initializer_list<SessionStream::Id> streams);
  /// The readings of clocks so far, in order: from the run's clock, which is the host's monotonic
  /// one, to UTC. Only sessions of live runs have them.
  [[nodiscard]] const std::vector<ClockReading>& clock_readings() const noexcept {
    return clock_readings_;
  }

  /// Reads the next chunk that holds items. False at the end.
  [[nodiscard]] Expected<bool, SetupError> next(SessionChunk& chunk);
  /// Calls visit(chunk) with each further chunk. It may return false to read no more.
  template <class Visit>
  [[nodiscard]] Expected<void, SetupError> for_each(const Visit& visit) {
    for (SessionChunk chunk;;) {
      const auto more = next(chunk);
      if (!more) return Unexpected<SetupError>(more.error());
      if (!*more) return {};
      if constexpr (std::is_void_v<std::invoke_result_t<const Visit&, SessionChunk&>>) {
        visit(chunk);
      } else if (!visit(chunk)) {
        return {};
      }
    }
  }

  /// True if the recording was closed properly; valid after next() returned false.
  [[nodiscard]] bool complete() const noexcept { return footers_ > 0 && !file_.truncated(); }

 private:
  SessionReader(std::string path, XdfFile file) : path_(std::move(path)), file_(std::move(file)) {}
  Expected<void, SetupError> read_headers(std::string_view rig);
  Expected<void, SetupError> read_stream_header();
  Expected<void, SetupError> add_stream(std::uint32_t id, const pugi::xml_node& info);
  Expected<void, SetupError> decode(std::string_view content, SessionChunk& chunk);
  /// The expected items of the probes, of ticks or samples.
  [[nodiscard]] std::span<FollowingItem> following(const SessionStream& stream);
  [[nodiscard]] bool is_of_ticks() const;
  Expected<void, SetupError> read_other_ticks(SessionChunk& chunk);

  std::string path_;
  XdfFile file_;
  std::vector<std::pair<std::string, std::string>> facts_;
  std::map<std::uint32_t, StreamLayout> layouts_;  ///< keyed by the stream's number in the file
  std::map<SessionStream::Id, std::vector<FollowingItem>> following_;
  std::uint32_t tick_streams_ = 0;
  XdfChunk raw_;
  bool raw_pending_ = false;     ///< raw_ was read ahead
  std::uint32_t decoded_ = ~0U;  ///< a bit for each SessionStream::Id
  std::optional<std::uint32_t> mark_stream_;
  std::optional<std::uint32_t> clock_stream_;
  std::vector<ClockReading> clock_readings_;
  bool has_validity_ = false;
  std::vector<std::string> extra_columns_;
  int footers_ = 0;
  std::unique_ptr<RigRecording> rig_;  ///< of a recording of LabRecorder
};

/// The start of the first tick of a recorded run, in the run's own time; if samples were recorded
/// without a simulation, the time of the first one. Reads the file from its beginning, whatever
/// `session` has read.
[[nodiscard]] Expected<std::chrono::nanoseconds, SetupError> session_start(
    const SessionReader& session);

/// The origin of a recorded run: a fact of the session; in older sessions, session_start().
[[nodiscard]] Expected<RunOrigin, SetupError> session_origin(const SessionReader& session);

}  // namespace merkel
