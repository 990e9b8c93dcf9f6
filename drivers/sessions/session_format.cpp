#include "drivers/sessions/session_format.hpp"

#include <algorithm>
#include <array>
#include <iterator>

#include "core/records/run_status.hpp"
#include "drivers/sessions/session_columns.hpp"

namespace merkel {
namespace {

using Channel = SessionStream::Channel;
using Id = SessionStream::Id;

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

constexpr std::array<SessionStream, kSessionStreams> kStreams = {{
    {Id::kSpikes, "merkel.spikes", "Spikes", true, kSessionChannels<std::int64_t, kSpikeColumns>},
    {Id::kTicks, "merkel.ticks", "TickInputs", false, kSessionChannels<double, kTickColumns>},
    {Id::kSamples, "merkel.samples", "ProbeSamples", false,
     kSessionChannels<double, kProbeSampleColumns>},
    {Id::kEvents, "merkel.events", "LoopEvents", true,
     kSessionChannels<std::int64_t, kEventColumns>},
    {Id::kStatus, "merkel.status", "Status", true, kStatusChannels, true},
    {Id::kFrames, "merkel.frames", "RawFrames", true, kFrameChannels},
    {Id::kStimulation, "merkel.stimulation", "StimulationCommands", false,
     kSessionChannels<double, kCommandColumns>},
}};

}  // namespace

std::span<const SessionStream> session_streams() noexcept { return kStreams; }

}  // namespace merkel
