#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
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
    kTaxels = 8
  };
  struct Channel {
    std::string_view label;
    std::string_view unit;
    std::string_view meaning = {};
    bool later = false;  ///< files of older versions lack it
  };

  Id id;
  std::string_view name;
  std::string_view type;
  bool integers;  ///< channel format int64, else double64
  std::span<const Channel> channels;
  /// True if a reader accepts missing channels: new versions add counters.
  bool open_ended = false;
};

/// The largest number of channels of a stream.
inline constexpr std::size_t kMostSessionChannels = 64;

/// The values of one item, in the order of its stream's table of channels.
template <class Value>
using ItemValues = std::array<Value, kMostSessionChannels>;

inline constexpr std::size_t kSessionStreams = 8;

/// All streams, in the order of their numbers from 1.
[[nodiscard]] std::span<const SessionStream> session_streams() noexcept;

/// The stream of marks, strings in the usual XDF form: "Markers". Readers identify it by
/// its name: older sessions have another number for it, or no such stream.
inline constexpr std::uint32_t kMarkStreamId = kSessionStreams + 1;
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
