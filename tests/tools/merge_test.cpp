// Sessions of clocks that drift, merged. tests/python/merge_test.py merges by the program.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/units.hpp"
#include "drivers/sinks/open_sink.hpp"
#include "tests/temporary_folder.hpp"
#include "tools/run/merged_sessions.hpp"
#include "tools/scene/scene_presets.hpp"
#include "tools/scene/session_scene.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using std::chrono::seconds;

constexpr int kLength_s = 240;

/// The clock of a rig: its time at a true time, which counts from the start of both runs.
struct RigClock {
  double offset_s = 0.0;
  double rate_ppm = 0.0;
  [[nodiscard]] nanoseconds operator()(nanoseconds time) const {
    return time + units::nanoseconds_from_s(offset_s) +
           nanoseconds{
               static_cast<std::int64_t>(rate_ppm * 1e-6 * static_cast<double>(time.count()))};
  }
};

using Facts = std::vector<std::pair<std::string, std::string>>;

/// Records a session of a rig: a spike and a sample every 100 ms, and marks.
std::string record(const std::string& path, const RigClock& clock, const std::vector<int>& marks_s,
                   const RunOrigin& origin, const Facts& facts) {
  static const Scene scene = *preset_scene("paper");
  static const TactileModel model = *TactileModel::create(scene.model);
  RunDescription run = describe_run(scene, model);
  std::erase_if(run.facts, [](const auto& fact) { return fact.first == "boot_id"; });
  run.facts.insert(run.facts.end(), facts.begin(), facts.end());
  add_probe_facts({.uri = "sim:ramp", .name = {}, .serial_number = {}}, run);
  auto sink = open_sink("xdf:" + path, {.neurons = static_cast<std::uint32_t>(model.neurons()),
                                        .run = std::move(run)});
  EXPECT_TRUE(sink);
  EXPECT_TRUE((*sink)->begin(origin));
  for (int step = 0; step < 10 * kLength_s; ++step) {
    const nanoseconds time = clock(milliseconds{100 * step});
    const SpikeEvent spike{.time = time, .neuron = static_cast<std::uint32_t>(1 + step % 20)};
    const DeliveredSample sample{.sample = {.time = time,
                                            .arrival = time,
                                            .depth_mm = 1.0 + 1e-3 * step,
                                            .channels = ProbeSample::kDepth}};
    std::vector<Mark> marks;
    for (const int mark_s : marks_s) {
      if (10 * mark_s == step) marks.push_back({.time = time, .label = "sync"});
    }
    TickRecord tick;
    tick.number = static_cast<std::uint64_t>(step + 1);
    tick.time = time + milliseconds{1};
    EXPECT_TRUE((*sink)->write(
        {.samples = {&sample, 1}, .spikes = {&spike, 1}, .ticks = {&tick, 1}, .marks = marks}));
    if (step % 5 != 0) continue;
    EXPECT_TRUE((*sink)->flush());
  }
  EXPECT_TRUE((*sink)->close());
  return path;
}

/// The largest distance of the two sessions' spikes of one step, and whether all is in order.
double largest_error_ms(MergedSessions& merged) {
  std::vector<nanoseconds> first;
  std::vector<nanoseconds> other;
  nanoseconds last = nanoseconds::min();
  std::size_t samples = 0;
  EXPECT_TRUE(merged.read([&](const RecordBatch& batch) {
    for (const SpikeEvent& spike : batch.spikes) {
      EXPECT_GE(spike.time, last);
      last = spike.time;
      (spike.neuron <= 20 ? first : other).push_back(spike.time);
    }
    samples += batch.samples.size();
    return true;
  }));
  EXPECT_EQ(first.size(), 10U * kLength_s);
  EXPECT_EQ(other.size(), first.size());
  EXPECT_EQ(samples, 2 * first.size());
  double largest_ms = 0.0;
  for (std::size_t i = 0; i < std::min(first.size(), other.size()); ++i) {
    largest_ms = std::max(largest_ms, units::ms_from(std::chrono::abs(other[i] - first[i])));
  }
  return largest_ms;
}

TEST(Merge, MarksGiveOffsetAndRateOfADriftingClock) {
  for (const RigClock& clock : {RigClock{3.25, 50.0}, RigClock{-1.5, -300.0}}) {
    const TemporaryFolder folder;
    const std::vector<int> marks = {10, 130, 220};
    const auto a = record(folder.path("a.xdf"), {}, marks, {}, {});
    const auto b = record(folder.path("b.xdf"), clock, marks, {}, {});
    const auto merged = MergedSessions::open({a, b}, {.mark = "sync"});
    ASSERT_TRUE(merged) << merged.error().sentence;
    const double error_ms = largest_error_ms(**merged);
    EXPECT_LT(error_ms, 0.2);
    const auto& alignment = (*merged)->alignments().front();
    ASSERT_TRUE(alignment.residual);
    EXPECT_GE(units::ms_from(*alignment.residual), error_ms);
    EXPECT_LT(units::ms_from(*alignment.residual), 0.2);
    EXPECT_NEAR(alignment.rate * 1e6, -clock.rate_ppm, 0.1 + 1e-3 * std::abs(clock.rate_ppm));
  }
}

TEST(Merge, UtcOfOneReadingIsAsUncertainAsAClockThatDrifts) {
  const TemporaryFolder folder;
  const RunOrigin origin{.start = nanoseconds{0}, .utc = seconds{1'700'000'000}};
  const Facts synchronised = {{"utc_error_ns", "1000000"}};
  const auto a = record(folder.path("a.xdf"), {}, {}, origin, synchronised);
  const auto b = record(folder.path("b.xdf"), {0.0, 500.0}, {}, origin, synchronised);
  const auto merged = MergedSessions::open({a, b}, {});
  ASSERT_TRUE(merged) << merged.error().sentence;
  const auto& alignment = (*merged)->alignments().front();
  ASSERT_TRUE(alignment.residual);
  const double error_ms = largest_error_ms(**merged);
  EXPECT_GT(error_ms, 100.0);
  EXPECT_GE(units::ms_from(*alignment.residual), error_ms);
}

TEST(Merge, RecordsOfManySessionsComeInOrderWhicheverBeginsFirst) {
  const TemporaryFolder folder;
  std::vector<std::string> paths;
  for (int i = 0; i < 7; ++i) {
    const RigClock clock{.offset_s = 20.0 * (i * 3 % 7) + 0.0123 * i};
    const nanoseconds start = clock(nanoseconds{0});
    paths.push_back(record(folder.path(std::to_string(i) + ".xdf"), clock, {},
                           {.start = start, .utc = seconds{1'700'000'000} + start},
                           {{"boot_id", "one"}}));
  }
  const auto merged = MergedSessions::open(paths, {});
  ASSERT_TRUE(merged) << merged.error().sentence;
  for (int reading = 0; reading < 2; ++reading) {
    nanoseconds last = nanoseconds::min();
    std::vector<std::size_t> of_session(7);
    ASSERT_TRUE((*merged)->read([&](const RecordBatch& batch) {
      EXPECT_TRUE(std::is_sorted(batch.spikes.begin(), batch.spikes.end()));
      for (const SpikeEvent& spike : batch.spikes) {
        EXPECT_GE(spike.time, last);
        last = spike.time;
        ++of_session[(spike.neuron - 1) / 20];
      }
      return true;
    }));
    EXPECT_EQ(of_session, std::vector<std::size_t>(7, 10U * kLength_s));
    EXPECT_TRUE((*merged)->complete());
  }
}

}  // namespace
}  // namespace merkel
