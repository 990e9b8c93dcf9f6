#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace merkel {

/// The streams of a recorded session: an XDF file (github.com/sccn/xdf), in which every sample of a
/// stream has the same numeric channels. Times are split so that no digit is lost: XDF's own
/// stamps, doubles in seconds, are there for other readers and are not read back.
struct SessionStream {
  enum class Id : std::uint32_t {
    kSpikes = 1,
    kTicks = 2,
    kSamples = 3,
    kEvents = 4,
    kStatus = 5,
    kFrames = 6,
    kStimulation = 7
  };
  struct Channel {
    std::string_view label;
    std::string_view unit;
    std::string_view meaning = {};
  };

  Id id;
  std::string_view name;
  std::string_view type;
  bool integers;  ///< channel format int64, else double64
  std::span<const Channel> channels;
  /// Whether a reader accepts a file without some of the channels: counters come with versions.
  bool open_ended = false;
};

/// No stream of a session has more channels.
inline constexpr std::size_t kMostSessionChannels = 64;

/// All streams, in the order of their numbers from 1.
[[nodiscard]] std::span<const SessionStream> session_streams() noexcept;

/// The stream of marks, of strings as other XDF readers expect them: "Markers". Readers know it by
/// its name: older sessions have another number for it, or no such stream.
inline constexpr std::uint32_t kMarkStreamId = 8;
inline constexpr std::string_view kMarkStreamName = "merkel.marks";

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
