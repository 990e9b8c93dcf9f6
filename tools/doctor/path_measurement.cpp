#include "tools/doctor/path_measurement.hpp"

#include <algorithm>
#include <atomic>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <unistd.h>

#include "core/units.hpp"
#include "drivers/probes/open_probe.hpp"
#include "realtime/clocks/periodic_clock.hpp"
#include "realtime/queues/bounded_queue.hpp"
#include "tools/doctor/hung_page.hpp"
#include "tools/doctor/loopback.hpp"
#include "tools/doctor/spike_matcher.hpp"

namespace merkel {
namespace {

constexpr std::size_t kQueue = 65536;  // arrivals between two polls, one second apart

/// Steal time: the time that the hypervisor took from all cores since the host started.
std::chrono::nanoseconds stolen() {
  std::ifstream file("/proc/stat");
  std::string cpu;
  std::int64_t column = 0;
  file >> cpu;
  for (int i = 0; i < 8; ++i) file >> column;  // the eighth column is steal
  const std::int64_t a_second = std::max(1L, ::sysconf(_SC_CLK_TCK));
  return file ? std::chrono::nanoseconds{column * (1'000'000'000 / a_second)}
              : std::chrono::nanoseconds{0};
}

/// The arrivals at one consumer, queued from its thread to the matcher.
struct Arrivals {
  Arrivals(const char* of, const char* json_key, std::chrono::nanoseconds good_median,
           std::chrono::nanoseconds tick)
      : name(of), key(json_key), good(good_median), matcher(tick) {}
  const char* name;
  const char* key;
  std::chrono::nanoseconds good;
  BoundedQueue<SpikeArrival> queue{kQueue};
  SpikeMatcher matcher;
  std::atomic<std::uint64_t> count{0};

  void note(std::chrono::nanoseconds spike, std::chrono::nanoseconds now) {
    ++count;
    // If the queue is full, the arrival is counted but not measured.
    static_cast<void>(queue.try_push({.spike = spike, .arrival = now}));
  }
  void match() {
    SpikeArrival arrival;
    while (queue.try_pop(arrival)) matcher.add(arrival);
    matcher.match();
  }
  [[nodiscard]] ConsumerLatency latency(std::uint64_t made) const {
    return {.name = name,
            .key = key,
            .good = good,
            .spikes = count.load(),
            .missing = made - count.load(),
            .unmatched = matcher.unmatched(),
            .sink = matcher.sink(),
            .software = matcher.software(),
            .sample_to_received = matcher.sample_to_received()};
  }
};

/// A thread that takes spikes within this program, until they end or it is told to stop.
std::jthread start_polling(SpikeConsumer& consumer, Arrivals& arrivals) {
  return std::jthread([&consumer, &arrivals](const std::stop_token& stop) {
    set_up_helper_thread("merkel-poll");
    SpikeEvent spike;
    while (!stop.stop_requested()) {
      const bool ended = consumer.ended();
      while (consumer.try_pop(spike)) arrivals.note(spike.time, PeriodicClock::now());
      if (ended) return;
      consumer.wait();
    }
  });
}

/// One sample period of the simulated probe plus a margin for its thread. The delay is fixed,
/// because measuring it would take the first second of the measurement.
constexpr std::chrono::microseconds kDelay{1500};

std::string probe_uri(std::chrono::nanoseconds duration) {
  // Pressed throughout the measurement, with an oscillation, so that spikes never stop.
  return "sim:sine?depth_mm=2&amplitude_mm=0.3&frequency_hz=5&wait_s=0.05&tail_s=0.05&live=1&hold_"
         "s=" +
         std::to_string(units::s_from(duration));
}

}  // namespace

double PathMeasurement::missed_fraction() const noexcept {
  const auto all = static_cast<double>(report.ticks + report.skipped_ticks);
  return all > 0.0 ? static_cast<double>(missed()) / all : 0.0;
}

Expected<PathMeasurement, SetupError> measure_path(
    const PathSettings& settings, const std::function<void(const RunProgress&)>& on_progress,
    const std::function<void(Pipeline*)>& started) {
  TactileModel::Parameters scene;
  scene.tick = settings.tick;
  auto model = TactileModel::create(scene);
  if (!model) return bad_input(model.error().key + " " + model.error().reason);
  auto probe = open_probe(probe_uri(settings.duration));
  if (!probe) return Unexpected<SetupError>(probe.error());

  Arrivals in_process("polling consumer", "in_process", std::chrono::microseconds{60},
                      settings.tick);
  // Its messages are written and parsed as JSON.
  Arrivals subscriber("ZeroMQ subscriber", "zmq", std::chrono::microseconds{500}, settings.tick);
  auto loopback = Loopback::open(
      static_cast<std::uint32_t>(model->neurons()),
      [&](std::chrono::nanoseconds spike) { subscriber.note(spike, PeriodicClock::now()); });
  if (!loopback) return Unexpected<SetupError>(loopback.error());
  std::vector<Arrivals*> all = {&in_process};
  if (*loopback) all.push_back(&subscriber);

  BoundedQueue<TickTiming> timings(kQueue);
  const auto match = [&] {
    TickTiming timing;
    while (timings.try_pop(timing)) {
      for (Arrivals* const at : all) at->matcher.add(timing);
    }
    for (Arrivals* const at : all) at->match();
  };
  Pipeline pipeline(*model, {.delay = kDelay,
                             .duration = settings.duration,
                             .wait = settings.wait,
                             .realtime = settings.realtime,
                             .timings = &timings,
                             .on_progress = [&](const RunProgress& progress) {
                               match();
                               if (on_progress) on_progress(progress);
                             }});
  pipeline.add_probe(std::move(*probe), {});
  if (*loopback) pipeline.add_sink((*loopback)->sink());
  std::optional<HungPage> page;
  if (settings.page) {
    auto opened = HungPage::open(*model);
    if (!opened) return Unexpected<SetupError>(opened.error());
    page.emplace(std::move(*opened));
    pipeline.add_sink(page->sink());
  }
  SpikeConsumer consumer = pipeline.add_consumer(kQueue);
  std::jthread poller = start_polling(consumer, in_process);

  const auto stolen_before = stolen();
  if (started) started(&pipeline);
  auto report = pipeline.run();
  if (started) started(nullptr);
  if (!report) {
    poller.request_stop();
    return Unexpected<SetupError>(report.error());
  }
  poller.join();
  if (*loopback) (*loopback)->settle(report->spikes);
  match();
  PathMeasurement measured{.report = std::move(*report), .steal = stolen() - stolen_before};
  for (const Arrivals* const at : all) {
    measured.consumers.push_back(at->latency(measured.report.spikes));
  }
  return measured;
}

}  // namespace merkel
