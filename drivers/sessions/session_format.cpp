#include "drivers/sessions/session_format.hpp"

#include <array>

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
                                       {"channels", "bits: 1 depth, 2 force, 4 x, 8 y"}};
constexpr Channel kEventChannels[] = {{"time_ns", "ns"},
                                      {"length_ns", "ns"},
                                      {"subject", "probe from 0, or neuron from 1"},
                                      {"kind", "0 release, 1 resume, 2 gap, 3 neuron_reset"}};
constexpr Channel kStatusChannels[] = {{"ticks", ""},
                                       {"overruns", ""},
                                       {"longest_overrun_ns", "ns"},
                                       {"catch_up_ticks", ""},
                                       {"gaps", ""},
                                       {"skipped_ticks", ""},
                                       {"spikes", ""},
                                       {"neuron_resets", ""},
                                       {"samples", ""},
                                       {"samples_dropped", ""},
                                       {"lost_spikes", "not in this file"},
                                       {"lost_ticks", "not in this file"},
                                       {"lost_events", "not in this file"},
                                       {"lost_samples", "not in this file"}};

constexpr std::array<SessionStream, 5> kStreams = {{
    {Id::kSpikes, "merkel.spikes", "Spikes", true, kSpikeChannels},
    {Id::kTicks, "merkel.ticks", "TickInputs", false, kTickChannels},
    {Id::kSamples, "merkel.samples", "ProbeSamples", false, kSampleChannels},
    {Id::kEvents, "merkel.events", "Events", true, kEventChannels},
    {Id::kStatus, "merkel.status", "Status", true, kStatusChannels},
}};

}  // namespace

std::span<const SessionStream> session_streams() noexcept { return kStreams; }

}  // namespace merkel
