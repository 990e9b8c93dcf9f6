#include "realtime/run_probes.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <thread>
#include <utility>

#include "core/printed.hpp"
#include "core/units.hpp"
#include "realtime/clocks/periodic_clock.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr std::size_t kSampleQueue = 4096;
constexpr std::size_t kLargestSampleQueue = 1'000'000;
constexpr std::size_t kLargestArrayQueue = 8192;  ///< of readings with pressures
constexpr milliseconds kReadAhead{4000};          ///< how far a recording's reader runs ahead
constexpr milliseconds kSilence{2000};  ///< a device that sends nothing for this long is refused
constexpr nanoseconds kUnknownPeriod{1'000'000};
constexpr milliseconds kMeasuring{3000};  ///< at most; one second is enough for most devices
constexpr int kPlaceInTick = 4;           ///< a tick ends this part of a period after a sample

std::size_t queue_capacity(const ProbeInfo& info) {
  const auto period = std::max(info.period.value_or(kUnknownPeriod), nanoseconds{1});
  return std::clamp(static_cast<std::size_t>(kReadAhead / period), kSampleQueue,
                    info.taxels > 0 ? kLargestArrayQueue : kLargestSampleQueue);
}

/// The taxels of an array have a zero each, so their sum needs none.
ContactDecision::Parameters contact_of(const ProbeInfo& info,
                                       const ProbeInput::Parameters& parameters) {
  ContactDecision::Parameters contact = parameters.contact;
  if (info.taxels > 0) contact.zero = ContactDecision::Zero::kFixed;
  return contact;
}

/// What a device without a sample has sent instead, and what to do.
std::string no_sample(const std::optional<DeviceCounts>& device) {
  const std::string duration = std::to_string(kSilence.count() / 1000) + " s";
  if (!device || device->bytes == 0) {
    return " has sent nothing for " + duration + ": check that it is switched on and streaming";
  }
  const std::string sent =
      device->unexpected.empty() ? "" : ": its device sent " + device->unexpected;
  if (device->readings > 0) {
    return " has had no value, or an impossible one, for " + duration + sent +
           "; check its sensor and its column";
  }
  if (device->refused > device->damaged) {
    return " has sent " + std::to_string(device->refused) +
           " readings, each without a value or beyond 10 kN or 1 m" + sent +
           "; check its sensor and its units (is the unit mN or µm?)";
  }
  return " has sent " + std::to_string(device->bytes) + " bytes but no valid sample in " +
         duration + " (" + std::to_string(device->damaged) + " frames damaged)" + sent +
         "; check its protocol and options";
}

}  // namespace

RunProbes::Route::Route(Device& the_device, std::size_t the_output,
                        const ProbeInput::Parameters& the_parameters,
                        const std::shared_ptr<ReadingRing>& ring)
    : device(&the_device),
      output(the_output),
      parameters(the_parameters),
      channel(ring, the_output),
      contact(contact_of(info(), the_parameters), info().replayed) {}

const ProbeInfo& RunProbes::Route::info() const noexcept {
  return device->probe->outputs()[output];
}

const ProbeInfo& RunProbes::info(std::size_t probe) const noexcept {
  return routes_[probe]->info();
}

std::size_t RunProbes::queue_bytes(const ProbeInfo& probe) {
  return queue_capacity(probe) * (sizeof(ReadingHead) + columns_of(probe).width() * sizeof(double));
}

nanoseconds RunProbes::newest() const noexcept {
  std::int64_t newest_ns = 0;
  for (const auto& route : routes_) {
    newest_ns = std::max(newest_ns, route->channel.newest_ns.load(std::memory_order_relaxed));
  }
  return nanoseconds{newest_ns};
}

void RunProbes::add(std::unique_ptr<Probe> device, const std::vector<RunInput>& inputs) {
  Device& added = *devices_.emplace_back(std::make_unique<Device>());
  added.probe = std::move(device);
  std::size_t capacity = kLargestSampleQueue;
  for (const ProbeInfo& info : added.probe->outputs()) {
    capacity = std::min(capacity, queue_capacity(info));
  }
  const auto ring = std::make_shared<ReadingRing>(columns_of(added.probe->outputs()), capacity);
  for (std::size_t output = 0; output < inputs.size(); ++output) {
    const RunInput& input = inputs[output];
    if (routes_.size() <= input.probe) routes_.resize(input.probe + 1);
    routes_[input.probe] = std::make_unique<Route>(added, output, input.parameters, ring);
    added.routes.push_back(routes_[input.probe].get());
  }
}

bool RunProbes::complete() const noexcept {
  return std::all_of(routes_.begin(), routes_.end(),
                     [](const auto& route) { return route != nullptr; });
}

bool RunProbes::all_replayed() const {
  return std::all_of(devices_.begin(), devices_.end(),
                     [](const auto& device) { return device->probe->info().replayed; });
}

void RunProbes::start(const MakeFeeds& make_feeds,
                      const std::optional<RealtimeSettings>& realtime) {
  const bool mixed = !all_replayed();
  std::vector<std::vector<Feed<DeliveredSample>*>> feeds;
  for (std::size_t i = 0; i < routes_.size(); ++i) {
    // A recording's reader fills both the loop's ring and this one before anything is drained.
    feeds.push_back(make_feeds(queue_capacity(routes_[i]->info()) + kSampleQueue,
                               static_cast<std::uint32_t>(i), routes_[i]->channel.columns()));
    inputs_.emplace_back(routes_[i]->channel, routes_[i]->parameters);
  }
  for (const auto& device : devices_) {
    // Together with devices, a recording plays as if it were acquired now.
    const bool replayed = device->probe->info().replayed;
    const nanoseconds shift = replayed && mixed ? PeriodicClock::now() : nanoseconds{0};
    std::vector<ProbeReader::Receivers> receivers(device->routes.size());
    for (std::size_t i = 0; i < routes_.size(); ++i) {
      Route& route = *routes_[i];
      if (route.device != device.get()) continue;
      receivers[route.output] = {.channel = &route.channel,
                                 .contact = &route.contact,
                                 .probe = static_cast<std::uint32_t>(i),
                                 .feeds = std::move(feeds[i])};
    }
    device->reader = std::make_unique<ProbeReader>(
        *device->probe, std::move(receivers), device->feeds,
        ProbeReader::Parameters{.shift = shift,
                                .realtime = replayed ? std::nullopt : realtime,
                                .wait_for_sinks = !realtime});
  }
}

Expected<void, SetupError> RunProbes::wait_for_first_samples(const std::atomic<bool>& stop) {
  const nanoseconds deadline = PeriodicClock::now() + kSilence;
  for (const auto& route : routes_) {
    const ProbeQueue& channel = route->channel;
    const ProbeInfo& info = route->info();
    // A recording starts with a well-filled queue, so that none of its samples is late.
    const std::uint64_t wanted = info.replayed ? kSampleQueue / 2 : 1;
    const auto waiting = [&]() -> std::uint64_t {
      return info.replayed ? channel.ring->size_approx() : channel.delivered.value();
    };
    while (waiting() < wanted && !channel.ended.load(std::memory_order_acquire) &&
           !stop.load(std::memory_order_relaxed)) {
      if (PeriodicClock::now() > deadline) {
        if (channel.delivered.value() > 0) break;
        return unavailable("the probe " + info.uri +
                           no_sample(route->device->probe->device_counts()));
      }
      std::this_thread::sleep_for(std::chrono::microseconds{info.replayed ? 50 : 1000});
    }
  }
  for (std::size_t i = 0; i < routes_.size(); ++i) {
    if (inputs_[i].first_time()) continue;
    const Route& route = *routes_[i];
    route.device->reader->stop();
    const ProbeInfo& info = route.info();
    const std::string& error_message = route.device->reader->error_message();
    if (error_message.empty() && stop.load(std::memory_order_relaxed)) {
      return unavailable("stopped before the probe " + info.uri +
                         " delivered a sample: nothing was simulated");
    }
    return Unexpected<SetupError>(
        {.kind = info.replayed ? SetupError::Kind::kBadInput : SetupError::Kind::kUnavailable,
         .sentence =
             error_message.empty()
                 ? "the probe " + info.uri + " delivered no samples, so nothing can be simulated"
                 : error_message});
  }
  return {};
}

void RunProbes::wait_for_timing(const std::atomic<bool>& stop) const {
  const nanoseconds deadline = PeriodicClock::now() + kMeasuring;
  for (const auto& device : devices_) {
    if (!device->probe->status().timed) continue;
    const ProbeQueue& channel = device->routes.front()->channel;
    while (!device->probe->timing() && !channel.ended.load(std::memory_order_acquire) &&
           channel.delivered.value() < kSampleQueue / 2 && !stop.load(std::memory_order_relaxed) &&
           PeriodicClock::now() < deadline) {
      std::this_thread::sleep_for(milliseconds{1});
    }
  }
}

std::pair<nanoseconds, nanoseconds> RunProbes::first_times() const {
  const bool recordings = all_replayed();
  std::vector<nanoseconds> times;
  for (std::size_t i = 0; i < routes_.size(); ++i) {
    const auto& run = routes_[i]->info().run;
    times.push_back(recordings && run ? run->start : *inputs_[i].first_time());
  }
  const auto [earliest, latest] = std::minmax_element(times.begin(), times.end());
  return {*earliest, *latest};
}

std::optional<RecordedRun> RunProbes::recorded_run() const {
  if (!all_replayed()) return std::nullopt;
  for (const auto& device : devices_) {
    if (const auto& run = device->probe->info().run) return run;
  }
  return std::nullopt;
}

nanoseconds RunProbes::measured_delay() const {
  nanoseconds delay{0};
  for (const auto& route : routes_) {
    const ProbeInfo& info = route->info();
    if (info.replayed) continue;
    const auto timing = route->device->probe->timing();
    if (timing) {
      const nanoseconds needed =
          route->parameters.interpolate ? timing->delay : timing->delay_of_newest;
      const nanoseconds ceiling = SampleTiming::delay_ceiling(timing->period);
      delay = std::max(delay, std::min(needed, route->parameters.max_delay.value_or(ceiling)));
    } else {
      delay = std::max(delay, 2 * info.period.value_or(kUnknownPeriod));
    }
  }
  return delay;
}

void RunProbes::add_devices_to(RunWatch& watch, std::span<const std::size_t> patches) const {
  for (std::size_t i = 0; i < routes_.size(); ++i) {
    if (!routes_[i]->info().replayed) watch.add_device(patches[i], routes_[i]->channel);
  }
}

Expected<void, SetupError> RunProbes::check_ceilings() const {
  for (const auto& route : routes_) {
    const auto timing = route->device->probe->timing();
    const auto& ceiling = route->parameters.max_delay;
    if (!timing || !ceiling || !route->parameters.interpolate || *ceiling > timing->period)
      continue;
    return bad_input(
        printed("probe.max_delay_ms = %.4g is not longer than the sample period of %s, %.4g ms, "
                "and linear interpolation waits for the next sample: set max_delay_ms = %.4g, or "
                "loop.interpolation = \"hold\"",
                units::ms_from(*ceiling), route->info().uri.c_str(), units::ms_from(timing->period),
                std::ceil(3.0 * units::ms_from(timing->period))));
  }
  return {};
}

Expected<void, SetupError> RunProbes::check_watchdog(nanoseconds watchdog) const {
  for (const auto& device : devices_) {
    const ProbeInfo& info = device->probe->info();
    const auto timing = device->probe->timing();
    const nanoseconds period = timing ? timing->period : info.period.value_or(nanoseconds{0});
    if (info.replayed || watchdog >= period * 3 / 2) continue;
    return bad_input(
        printed("stimulation.watchdog_ms = %.4g is too short for %s, which sends a sample every "
                "%.4g ms: set watchdog_ms = %.4g",
                units::ms_from(watchdog), info.uri.c_str(), units::ms_from(period),
                std::ceil(2.0 * units::ms_from(period))));
  }
  return {};
}

nanoseconds RunProbes::aligned(nanoseconds start, nanoseconds tick) const {
  const auto& first = *devices_.front();
  const auto timing = first.probe->timing();
  if (!timing) return start;
  const nanoseconds newest{first.routes.front()->channel.newest_ns.load(std::memory_order_relaxed)};
  const nanoseconds place = std::min(timing->period, tick) / kPlaceInTick;
  return start - (tick - (newest + place - start) % tick) % tick;
}

void RunProbes::set_ticks(nanoseconds start, nanoseconds tick) noexcept {
  for (ProbeInput& input : inputs_) {
    if (input.estimate() != nullptr) input.estimate()->set_ticks(start, tick);
  }
}

void RunProbes::measure_delays() {
  for (std::size_t i = 0; i < routes_.size(); ++i) {
    if (!routes_[i]->info().replayed) inputs_[i].measure_delay();
  }
}

std::vector<RunProgress::ProbeProgress> RunProbes::readings() const {
  std::vector<RunProgress::ProbeProgress> readings;
  for (const auto& route : routes_) {
    readings.push_back(
        {.depth_mm = route->channel.depth_mm.load(std::memory_order_relaxed),
         .force_mN = route->channel.force_mN.load(std::memory_order_relaxed),
         .channels = route->info().channels,
         .state = route->channel.state.load(std::memory_order_relaxed),
         .name = route->info().name,
         .live = !route->info().replayed,
         .touch = nanoseconds{route->channel.touch_ns.load(std::memory_order_relaxed)}});
  }
  return readings;
}

void RunProbes::add_to(RunCounters& counters) const {
  counters.probe_count = routes_.size();
  for (const auto& route : routes_) {
    const ProbeQueue& channel = route->channel;
    counters.samples += channel.delivered.value() + channel.dropped.value();
    counters.samples_dropped += channel.dropped.value();
    counters.samples_late += channel.late.value();
    counters.held_ticks += channel.held_ticks.value();
    counters.released_ticks += channel.released_ticks.value();
    if (channel.ended.load(std::memory_order_relaxed)) ++counters.probes_ended;
  }
  for (const auto& device : devices_) {
    if (const auto counts = device->probe->device_counts()) merge(counters, *counts);
  }
}

void RunProbes::take_notices(const std::function<void(const std::string&)>& on_notice) {
  for (const auto& device : devices_) {
    for (const std::string& sentence : device->probe->take_notices()) {
      if (on_notice) on_notice(sentence);
    }
  }
}

void RunProbes::stop() {
  for (const auto& device : devices_) {
    if (device->reader) device->reader->stop();
  }
}

void RunProbes::finish(RunReport& report) {
  stop();
  for (std::size_t i = 0; i < routes_.size(); ++i) {
    const Route& route = *routes_[i];
    const Probe& device = *route.device->probe;
    if (report.error_message.empty()) {
      report.error_message = route.device->reader->error_message();
      report.bad_input = route.device->reader->bad_input();
    }
    RunReport::ProbeReport& of = report.probes[i];
    of.uri = route.info().uri;
    of.counts = inputs_[i].counts();
    ProbeStatus status = device.status();
    of.device = std::move(status.device);
    of.shares_device = !is_first_of_device(i);
    of.timing = status.timing;
    if (route.output < status.faults.size()) of.faults = std::move(status.faults[route.output]);
    of.channels = route.info().channels;
    of.decimate = route.parameters.decimate;
    of.stale_after =
        route.parameters.stale_after.value_or(of.timing ? of.timing->stale_after : nanoseconds{0});
    of.dropped = route.channel.dropped.value();
    of.drift = route.contact.drift();
    of.contact = route.parameters.contact;
    of.samples_in = route.channel.delivered.value() + of.dropped;
    of.unused = route.channel.delivered.value() - of.counts.used - of.counts.late;
  }
}

}  // namespace merkel
