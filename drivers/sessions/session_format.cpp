#include "drivers/sessions/session_format.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <type_traits>

#include "drivers/sessions/session_records.hpp"

namespace merkel {
namespace {

using Channel = SessionStream::Channel;

/// The status channels: all counters, the losses of this file, and the loop's rights.
constexpr auto kStatusChannels = [] {
  std::array<Channel, kRunCounterFields<>.size() + kLossFields.size() + kRightFields.size()> all{};
  std::size_t count = 0;
  const auto add = [&](const auto& fields) {
    for (const auto& field : fields) all[count++] = {field.name, field.unit, field.meaning};
  };
  add(kRunCounterFields<>);
  add(kLossFields);
  add(kRightFields);
  return all;
}();
static_assert(kStatusChannels.size() <= kMostSessionChannels);
/// The channels of a frame: its columns, and its bytes in words.
constexpr auto kFrameChannels = [] {
  constexpr auto& kColumns = kSessionChannels<std::int64_t, kFrameColumns>;
  constexpr Channel kWords[] = {{"bytes_0", "", "bytes 0 to 7, the first in the lowest bits"},
                                {"bytes_1", "", "bytes 8 to 15"},
                                {"bytes_2", "", "bytes 16 to 23"},
                                {"bytes_3", "", "bytes 24 to 31"},
                                {"bytes_4", "", "bytes 32 to 39"},
                                {"bytes_5", "", "bytes 40 to 47"},
                                {"bytes_6", "", "bytes 48 to 55"},
                                {"bytes_7", "", "bytes 56 to 63"}};
  std::array<Channel, kColumns.size() + std::size(kWords)> all{};
  std::copy(std::begin(kWords), std::end(kWords),
            std::copy(kColumns.begin(), kColumns.end(), all.begin()));
  return all;
}();

template <class Record>
constexpr SessionStream stream_of(std::string_view name, std::string_view type,
                                  std::span<const Channel> channels, bool open_ended = false) {
  using Stored = SessionStreamOf<Record>;
  constexpr bool kIntegers = std::is_same_v<typename Stored::Value, std::int64_t>;
  return {Stored::kId, name, type, kIntegers, channels, open_ended};
}
/// All its channels follow from the columns of its records.
template <class Record>
constexpr SessionStream stream_of(std::string_view name, std::string_view type) {
  using Stored = SessionStreamOf<Record>;
  return stream_of<Record>(name, type, kSessionChannels<typename Stored::Value, Stored::kColumns>);
}

constexpr std::array<SessionStream, kSessionStreams> kStreams = {{
    stream_of<SpikeEvent>("merkel.spikes", "Spikes"),
    stream_of<TickRecord>("merkel.ticks", "TickInputs"),
    stream_of<DeliveredSample>("merkel.samples", "ProbeSamples"),
    stream_of<LoopEvent>("merkel.events", "LoopEvents"),
    stream_of<RunStatus>("merkel.status", "Status", kStatusChannels, true),
    stream_of<PortFrame>("merkel.frames", "RawFrames", kFrameChannels),
    stream_of<StimulationCommand>("merkel.stimulation", "StimulationCommands"),
    stream_of<TaxelBlock>("merkel.taxels", "TaxelPressures"),
}};

}  // namespace

std::span<const SessionStream> session_streams() noexcept { return kStreams; }

}  // namespace merkel
