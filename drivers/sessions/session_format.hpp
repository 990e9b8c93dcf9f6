#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace merkel {

/// The streams of a recorded session: an XDF file (github.com/sccn/xdf). All samples of a stream
/// have the same numeric channels. Times are split into two channels to keep every digit; XDF's own
/// stamps, doubles in seconds, are for other readers and are not read back.
struct SessionStream {
  enum class Id : std::uint32_t {
    kSpikes = 1,
    kTicks = 2,
    kSamples = 3,
    kEvents = 4,
    kStatus = 5,
    kFrames = 6,
    kStimulation = 7,
    kTaxels = 8,
    kSent = 9,
    kSync = 10,
    kTaxelZeros = 11,
    kDrives = 12
  };
  /// How a value follows from that of the previous item of its probe.
  enum class Follows : std::uint8_t { kFreely, kAsBefore, kByOne, kByTick };
  struct Channel {
    std::string_view label;
    std::string_view unit;
    std::string_view meaning = {};
    bool later = false;                  ///< files of older versions lack it
    Follows follows = Follows::kFreely;  ///< otherwise it may be in the stream of states
    std::uint32_t measured = 0;          ///< ProbeSample::Channel: free if the probe measures it
  };

  Id id;
  std::string_view name;
  std::string_view type;
  bool integers;  ///< channel format int64, else double64
  std::span<const Channel> channels;
  /// True if a reader accepts missing channels: new versions add counters.
  bool open_ended = false;
  /// Each probe has such a stream, of the channels that change freely. The others are in the stream
  /// of states of this name, where a probe has an item whenever they do not follow. Empty: one
  /// stream for all probes, with all channels.
  std::string_view states = {};

  [[nodiscard]] constexpr bool of_probe() const noexcept { return !states.empty(); }
};

/// True if the stream of a probe has a channel. \param measured  ProbeSample::Channel bits
[[nodiscard]] constexpr bool is_free(const SessionStream::Channel& channel,
                                     std::uint32_t measured) noexcept {
  return channel.follows == SessionStream::Follows::kFreely || (channel.measured & measured) != 0U;
}

/// The largest number of channels of a stream.
inline constexpr std::size_t kMaxSessionChannels = 96;

/// The values of one item, in the order of its stream's table of channels.
template <class Value>
using ItemValues = std::array<Value, kMaxSessionChannels>;

inline constexpr std::size_t kSessionStreams = 12;

/// All streams, in the order of their numbers from 1.
[[nodiscard]] std::span<const SessionStream> session_streams() noexcept;

/// The stream of marks, strings in the usual XDF form: "Markers". Readers identify it by
/// its name: older sessions have another number for it, or no such stream.
inline constexpr std::uint32_t kMarkStreamId = kSessionStreams + 1;
inline constexpr std::string_view kMarkStreamName = "merkel.marks";

/// The stream of readings of the host's clocks, of runs in real time: monotonic_ns, on which the
/// run's times are, and utc_ns. Older sessions have none.
inline constexpr std::uint32_t kClockStreamId = kMarkStreamId + 1;
inline constexpr std::string_view kClockStreamName = "merkel.clocks";

/// The number of a probe's stream, and of its stream of states, in files of this version.
[[nodiscard]] std::uint32_t stream_number(const SessionStream& stream,
                                          std::uint32_t probe) noexcept;
[[nodiscard]] std::uint32_t states_number(const SessionStream& stream) noexcept;

/// The name of a probe's stream: that of the stream, then from the second probe on ".1", ".2", ….
[[nodiscard]] std::string stream_name(const SessionStream& stream, std::uint32_t probe);

/// The most probes of a session.
inline constexpr std::uint32_t kMaxSessionProbes = 64;

/// What the next item of a probe has in the channels that follow.
void follow(const SessionStream& stream, std::chrono::nanoseconds tick,
            ItemValues<double>& values) noexcept;

/// The kinds of XDF chunk.
enum class XdfTag : std::uint16_t {
  kFileHeader = 1,
  kStreamHeader = 2,
  kSamples = 3,
  kClockOffset = 4,
  kBoundary = 5,
  kStreamFooter = 6
};

}  // namespace merkel
