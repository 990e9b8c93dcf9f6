#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/expected.hpp"
#include "drivers/clock/clock_map.hpp"
#include "drivers/clock/pulse_match.hpp"
#include "tools/json_text.hpp"
#include "tools/run/merged_sessions.hpp"

namespace merkel {

/// What a session knows of its clock.
struct SessionClock {
  std::string path;
  std::string rig;       ///< in a recording of LabRecorder
  std::string boot;      ///< sessions of one boot of a host have one clock
  std::string recorder;  ///< as have rigs in one recording of LabRecorder
  bool live = false;     ///< its clock is the host's
  std::chrono::nanoseconds start{0};
  std::chrono::nanoseconds first{0};  ///< extent of its records
  std::chrono::nanoseconds last{0};
  std::vector<ClockReading> utc;                        ///< of its clock and UTC; empty: unknown
  std::optional<std::chrono::nanoseconds> clock_error;  ///< of UTC or the recorder's clock
  std::map<std::string, std::vector<std::chrono::nanoseconds>> marks;  ///< by label
  /// Edges of the sync lines of the first device that has some: low to high, and back, by line.
  std::map<std::uint32_t, std::vector<std::chrono::nanoseconds>> rises;
  std::map<std::uint32_t, std::vector<std::chrono::nanoseconds>> falls;

  /// Reads the whole file, but decodes little of it. \param other  with the same clock, this one's
  /// facts are enough; null: none
  [[nodiscard]] static Expected<SessionClock, SetupError> read(const RecordedSession& session,
                                                               const SessionClock* other);
  /// Whether sessions are of one boot of a host, or of one recorder.
  [[nodiscard]] bool shares_clock(const SessionClock& other) const {
    return recorder == other.recorder &&
           (!recorder.empty() || (!boot.empty() && boot == other.boot));
  }
};

/// Aligns a session with the first one. \param clock  converts its times to those of the first
[[nodiscard]] Expected<MergedSessions::Alignment, SetupError> align(const SessionClock& first,
                                                                    const SessionClock& other,
                                                                    const MergeSettings& settings,
                                                                    ClockMap& clock);

/// A session placed on another clock by pulses that both saw.
struct PulseAlignment {
  PulseMatch match;
  ClockFit fit;
  bool falling = false;  ///< the session's falling edges match: its line is inverted
};

/// Which pulses are matched.
struct PulseChoice {
  std::string mark = {};                   ///< the session's marks with this label instead
  std::optional<std::uint32_t> line = {};  ///< of the session; none: its only one
  std::chrono::nanoseconds tolerance{2'000'000};
};

/// Aligns a session with pulses on another clock. \param name  of those pulses, for messages
[[nodiscard]] Expected<PulseAlignment, SetupError> align_pulses(
    const SessionClock& session, const PulseChoice& choice,
    std::span<const std::chrono::nanoseconds> pulses, const std::string& name);

/// The facts of this name each record an alignment of a session, as a line of JSON.
inline constexpr std::string_view kAlignmentFact = "alignment";

struct RecordedAlignment {
  std::string to;                         ///< the other recorder's file, as the user gave it
  std::vector<ClockReading> points = {};  ///< of a ClockMap to the other clock
  Json json = {};                         ///< the whole value of the fact
};

/// The value of such a fact. \param to  the other recorder's file
[[nodiscard]] Json alignment_json(const PulseAlignment& aligned, const SessionClock& session,
                                  const std::string& to);
/// Nothing if a text is no such value.
[[nodiscard]] std::optional<RecordedAlignment> parse_alignment(std::string_view text);
/// All that a session records. \param facts  of the session
[[nodiscard]] std::vector<RecordedAlignment> recorded_alignments(
    std::span<const std::pair<std::string, std::string>> facts);

}  // namespace merkel
