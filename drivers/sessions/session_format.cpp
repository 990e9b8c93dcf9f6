#include "drivers/sessions/session_format.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <type_traits>
#include <utility>

#include "drivers/sessions/session_records.hpp"

namespace merkel {
namespace {

using Channel = SessionStream::Channel;

constexpr std::uint32_t kNumbersOfProbe = 32;  ///< above the numbers of all other streams
constexpr double kSecond_ns = 1e9;

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
static_assert(kStatusChannels.size() <= kMaxSessionChannels);
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

using Follows = SessionStream::Follows;

/// How a channel of ticks or samples follows.
constexpr Channel following(Channel channel, bool ticks) {
  constexpr std::pair<std::string_view, std::uint32_t> kMeasured[] = {
      {"depth_mm", ProbeSample::kDepth},
      {"force_mN", ProbeSample::kForce},
      {"x_mm", ProbeSample::kX},
      {"y_mm", ProbeSample::kY}};
  for (const auto& [label, bit] : kMeasured) {
    if (channel.label == label) channel.measured = bit;
  }
  constexpr std::string_view kAsBefore[] = {"probe",    "late",         "state",
                                            "channels", "valid_for_ns", "taxel_blocks",
                                            "doubts",   "zero_mN",      "touch"};
  const bool named =
      std::find(std::begin(kAsBefore), std::end(kAsBefore), channel.label) != std::end(kAsBefore);
  if (named || channel.measured != 0) channel.follows = Follows::kAsBefore;
  if (channel.label == "number" || channel.label == "sequence") channel.follows = Follows::kByOne;
  if (ticks && (channel.label == "time_s" || channel.label == "time_ns")) {
    channel.follows = Follows::kByTick;
  }
  return channel;
}
template <const auto& channels, bool ticks>
constexpr auto kFollowing = [] {
  auto all = channels;
  for (Channel& each : all) each = following(each, ticks);
  return all;
}();
constexpr auto& kTickChannels = kFollowing<kSessionChannels<double, kTickColumns>, true>;
constexpr auto& kSampleChannels = kFollowing<kSessionChannels<double, kProbeSampleColumns>, false>;

template <class Record>
constexpr SessionStream stream_of(std::string_view name, std::string_view type,
                                  std::span<const Channel> channels, bool open_ended = false,
                                  std::string_view states = {}) {
  using Stored = SessionStreamOf<Record>;
  constexpr bool kIntegers = std::is_same_v<typename Stored::Value, std::int64_t>;
  return {Stored::kId, name, type, kIntegers, channels, open_ended, states};
}
/// All its channels follow from the columns of its records.
template <class Record>
constexpr SessionStream stream_of(std::string_view name, std::string_view type) {
  using Stored = SessionStreamOf<Record>;
  return stream_of<Record>(name, type, kSessionChannels<typename Stored::Value, Stored::kColumns>);
}

constexpr std::array<SessionStream, kSessionStreams> kStreams = {{
    stream_of<SpikeEvent>("merkel.spikes", "Spikes"),
    stream_of<TickRecord>("merkel.ticks", "TickInputs", kTickChannels, false, "merkel.tick_states"),
    stream_of<DeliveredSample>("merkel.samples", "ProbeSamples", kSampleChannels, false,
                               "merkel.sample_states"),
    stream_of<LoopEvent>("merkel.events", "LoopEvents"),
    stream_of<RunStatus>("merkel.status", "Status", kStatusChannels, true),
    stream_of<PortFrame>("merkel.frames", "RawFrames", kFrameChannels),
    stream_of<StimulationCommand>("merkel.stimulation", "StimulationCommands"),
    stream_of<TaxelBlock>("merkel.taxels", "TaxelPressures"),
    stream_of<SentCommand>("merkel.sent", "SentCommands"),
    stream_of<SyncEdge>("merkel.sync", "SyncEdges"),
    stream_of<TaxelZeros>("merkel.taxel_zeros", "TaxelZeros"),
    stream_of<GivenDrive>("merkel.drives", "GivenDrives"),
}};

}  // namespace

std::span<const SessionStream> session_streams() noexcept { return kStreams; }

std::uint32_t stream_number(const SessionStream& stream, std::uint32_t probe) noexcept {
  const auto number = static_cast<std::uint32_t>(stream.id);
  return probe == 0 ? number : probe * kNumbersOfProbe + number;
}

std::uint32_t states_number(const SessionStream& stream) noexcept {
  return kMarkStreamId + static_cast<std::uint32_t>(stream.id);
}

std::string stream_name(const SessionStream& stream, std::uint32_t probe) {
  return std::string(stream.name) + (probe == 0 ? "" : "." + std::to_string(probe));
}

void follow(const SessionStream& stream, std::chrono::nanoseconds tick,
            ItemValues<double>& values) noexcept {
  for (std::size_t i = 0; i < stream.channels.size(); ++i) {
    const Follows follows = stream.channels[i].follows;
    if (follows == Follows::kByOne) values[i] += 1.0;
    // The nanoseconds follow the whole seconds.
    if (follows != Follows::kByTick || i == 0 || stream.channels[i].unit != "ns") continue;
    const double time_ns = values[i] + static_cast<double>(tick.count());
    const double whole_s = std::floor(time_ns / kSecond_ns);
    values[i] = time_ns - whole_s * kSecond_ns;
    values[i - 1] += whole_s;
  }
}

}  // namespace merkel
