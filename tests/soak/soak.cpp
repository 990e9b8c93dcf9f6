// Sends spikes of virtual time to sinks, at 5000 a second, through the queues and threads of a run;
// fails if a single one is lost. It goes as fast as the sinks take them or, for those that cannot
// throttle the sender (osc:, lsl:), at the given multiple of real time.
// usage: merkel_soak SECONDS[@SPEED] SINK_URI…
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string_view>
#include <thread>
#include <vector>

#include "core/math/random.hpp"
#include "core/units.hpp"
#include "drivers/sinks/open_sink.hpp"
#include "realtime/clocks/virtual_clock.hpp"
#include "realtime/output/fanout.hpp"
#include "realtime/output/sink_writer.hpp"

namespace {

constexpr std::uint32_t kNeurons = 1000;
constexpr int kSpikesPerTick = 5;
constexpr std::chrono::milliseconds kTick{1};

int soak(double seconds, double speed, const std::vector<const char*>& uris) {
  using namespace merkel;
  const SinkSetup setup{.neurons = kNeurons, .overwrite = true, .allow_remote = true, .run = {}};
  Fanout fanout;
  std::vector<std::unique_ptr<Sink>> sinks;
  std::vector<std::unique_ptr<SinkWriter>> writers;
  std::vector<ConsumerChannel*> channels;
  for (const char* const uri : uris) {
    auto sink = open_sink(uri, setup);
    if (!sink) {
      std::fprintf(stderr, "%s\n", sink.error().sentence.c_str());
      return 2;
    }
    sinks.push_back(std::move(*sink));
    channels.push_back(&fanout.add_consumer(65536));
    if (sinks.back()->takes<TickRecord>()) {
      channels.back()->add<TickRecord>(16384);
    }
  }
  for (std::size_t i = 0; i < sinks.size(); ++i) {
    writers.push_back(std::make_unique<SinkWriter>(
        *sinks[i],
        SinkWriter::Sources{.channel = *channels[i], .status = [] { return RunStatus{}; }}));
  }
  VirtualClock clock;
  Random random(1);
  std::vector<SpikeEvent> spikes(kSpikesPerTick);
  TickRecord tick;
  const auto ticks = static_cast<std::uint64_t>(seconds * 1000.0);
  const auto started = std::chrono::steady_clock::now();
  for (tick.number = 1; tick.number <= ticks; ++tick.number) {
    for (int k = 0; k < kSpikesPerTick; ++k) {
      spikes[static_cast<std::size_t>(k)] = {
          .time = tick.time + k * std::chrono::microseconds{190} + std::chrono::nanoseconds{7},
          .neuron = 1 + static_cast<std::uint32_t>(random.uniform() * kNeurons)};
    }
    tick.time += kTick;
    fanout.publish(std::span<const SpikeEvent>(spikes), clock);
    fanout.publish(std::span<const TickRecord>(&tick, 1), clock);
    if (speed > 0.0) {
      const std::chrono::duration<double> due(units::s_from(tick.time) / speed);
      std::this_thread::sleep_until(
          started + std::chrono::duration_cast<std::chrono::steady_clock::duration>(due));
    }
  }
  fanout.end();
  const std::uint64_t made = ticks * kSpikesPerTick;
  int lost = 0;
  for (std::size_t i = 0; i < writers.size(); ++i) {
    writers[i]->end(true);
    const auto outcome = writers[i]->finish();
    const bool whole = outcome.error_message.empty() && outcome.delivered == made &&
                       channels[i]->dropped<SpikeEvent>() == 0;
    std::printf("%-40s %llu of %llu spikes %s\n", uris[i],
                static_cast<unsigned long long>(outcome.delivered),
                static_cast<unsigned long long>(made), outcome.error_message.c_str());
    if (!whole) ++lost;
  }
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - started;
  std::printf("%g s of spikes in %.2f s\n", seconds, wall.count());
  return lost == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return 2;
  const std::string_view text = argv[1];
  const auto at = text.find('@');
  const double speed = at == std::string_view::npos ? 0.0 : std::atof(argv[1] + at + 1);
  return soak(std::atof(argv[1]), speed, {argv + 2, argv + argc});
}
