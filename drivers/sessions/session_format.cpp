#include "drivers/sessions/session_format.hpp"

#include <array>

#include "core/records/run_status.hpp"

namespace merkel {
namespace {

using Channel = SessionStream::Channel;
using Id = SessionStream::Id;

constexpr Channel kSpikeChannels[] = {
    {"time_ns", "ns"}, {"neuron", "number in its patch, from 1"}, {"patch", ""}, {"flags", ""}};
constexpr Channel kTickChannels[] = {{"number", ""},
                                     {"probe", "from 0"},
                                     {"time_s", "whole seconds"},
                                     {"time_ns", "ns beyond time_s"},
                                     {"latency_ns", "ns"},
                                     {"depth_mm", "mm"},
                                     {"force_mN", "mN"},
                                     {"x_mm", "mm"},
                                     {"y_mm", "mm"},
                                     {"late", "samples"},
                                     {"state", "0 following, 1 held, 2 released, 3 ended"}};
constexpr Channel kSampleChannels[] = {{"probe", "from 0"},
                                       {"time_s", "whole seconds"},
                                       {"time_ns", "ns beyond time_s"},
                                       {"arrival_s", "whole seconds"},
                                       {"arrival_ns", "ns beyond arrival_s"},
                                       {"depth_mm", "mm"},
                                       {"force_mN", "mN"},
                                       {"x_mm", "mm"},
                                       {"y_mm", "mm"},
                                       {"sequence", ""},
                                       {"channels", "bits: 1 depth, 2 force, 4 x, 8 y"},
                                       {"valid_for_ns", "ns", "how long it holds alone", true}};
constexpr Channel kEventChannels[] = {{"time_ns", "ns"},
                                      {"length_ns", "ns"},
                                      {"subject", "probe from 0, or neuron from 1"},
                                      {"kind", "0 release, 1 resume, 2 gap, 3 neuron_reset"}};
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
constexpr Channel kFrameChannels[] = {{"probe", "from 0"},
                                      {"port", "of the probe, from 0"},
                                      {"time_ns", "ns"},
                                      {"kind", "0 received, 1 sent, 2 opened, 3 started"},
                                      {"length", "bytes"},
                                      {"parsed", "frames"},
                                      {"damaged", "frames"},
                                      {"lost", "frames"},
                                      {"bytes_0", "bytes 0 to 7, the first in the lowest bits"},
                                      {"bytes_1", "bytes 8 to 15"},
                                      {"bytes_2", "bytes 16 to 23"},
                                      {"bytes_3", "bytes 24 to 31"},
                                      {"bytes_4", "bytes 32 to 39"},
                                      {"bytes_5", "bytes 40 to 47"},
                                      {"bytes_6", "bytes 48 to 55"},
                                      {"bytes_7", "bytes 56 to 63"}};

constexpr Channel kStimulationChannels[] = {
    {"time_s", "whole seconds"},
    {"time_ns", "ns beyond time_s"},
    {"electrode", "from 0, in the order of the scene"},
    {"kind", "0 update, 1 pulse"},
    {"amplitude_uA", "uA"},
    {"frequency_Hz", "Hz"},
    {"heartbeat", "number of the update, from 1"},
    {"stop", "0 none, 1 released, 2 gap, 3 neuron_reset, 4 sink_failure, 5 end"}};

constexpr std::array<SessionStream, kSessionStreams> kStreams = {{
    {Id::kSpikes, "merkel.spikes", "Spikes", true, kSpikeChannels},
    {Id::kTicks, "merkel.ticks", "TickInputs", false, kTickChannels},
    {Id::kSamples, "merkel.samples", "ProbeSamples", false, kSampleChannels},
    {Id::kEvents, "merkel.events", "LoopEvents", true, kEventChannels},
    {Id::kStatus, "merkel.status", "Status", true, kStatusChannels, true},
    {Id::kFrames, "merkel.frames", "RawFrames", true, kFrameChannels},
    {Id::kStimulation, "merkel.stimulation", "StimulationCommands", false, kStimulationChannels},
}};

}  // namespace

std::span<const SessionStream> session_streams() noexcept { return kStreams; }

}  // namespace merkel
