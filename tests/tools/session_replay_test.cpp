#include "tools/run/session_replay.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <filesystem>
#include <string_view>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "drivers/sessions/session_format.hpp"
#include "drivers/sinks/open_sink.hpp"
#include "realtime/loop/fixed_step_loop.hpp"
#include "realtime/output/sink_writer.hpp"
#include "tests/realtime/clocks/scripted_clock.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/program.hpp"
#include "tools/scene/scene_presets.hpp"
#include "tools/scene/session_scene.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

/// Records a session of a press in scripted time, with late samples, a loop that falls behind
/// twice, and a silent device.
std::string record_faulty_session(const TemporaryFolder& folder, LoopStatistics& statistics,
                                  ProbeInput::Counts& counts) {
  const Scene scene = *preset_scene("paper");
  auto model = TactileModel::create(scene.model);
  const std::string path = folder.path("faulty.xdf");
  auto sink =
      open_sink("xdf:" + path, SinkSetup{.neurons = static_cast<std::uint32_t>(model->neurons()),
                                         .overwrite = false,
                                         .allow_remote = false,
                                         .run = describe_run(scene, *model)});
  EXPECT_TRUE(sink);
  Fanout fanout;
  ConsumerChannel& channel = fanout.add_consumer(65536);
  channel.add<TickRecord>(16384);
  channel.add<LoopEvent>(1024);
  SinkWriter writer(**sink, {.channel = channel, .status = [] { return RunStatus{}; }});

  ProbeQueue probe(4096);
  std::vector<ProbeSample> samples;
  for (int k = 0; k <= 1500; ++k) {
    if (k > 700 && k < 900) continue;  // silent for longer than stale_after
    samples.push_back({.time = milliseconds{k},
                       // Now and then a burst arrives 30 ms late.
                       .arrival = milliseconds{k + (k % 200 < 30 ? 30 : 0)},
                       .depth_mm = 1.5 + 0.3 * ((k / 100) % 3),
                       .channels = ProbeSample::kDepth});
  }
  std::size_t next = 0;
  const auto deliver = [&](nanoseconds now) {
    while (next < samples.size() && samples[next].arrival <= now) {
      EXPECT_TRUE(probe.try_push(samples[next++]));
    }
    probe.ended = next == samples.size();
  };
  deliver(nanoseconds{0});
  int stalls = 0;
  ScriptedClock clock([&](nanoseconds until) {
    nanoseconds woken = until;
    if (until > milliseconds{300} && stalls == 0) {
      ++stalls;
      woken += milliseconds{7};  // caught up
    } else if (until > milliseconds{500} && stalls == 1) {
      ++stalls;
      woken += milliseconds{60};  // too long: a gap
    }
    deliver(woken);
    return woken;
  });
  std::vector<ProbeInput> inputs{ProbeInput(probe, {.stale_after = milliseconds{50}})};
  BoundedQueue<LoopEvent> events(1024);
  FixedStepLoop<ScriptedClock> loop({.start = nanoseconds{0},
                                     .wall_offset = nanoseconds{0},
                                     .delay = milliseconds{2},
                                     .duration = {},
                                     .max_catch_up_ticks = 20},
                                    clock, *model, inputs, fanout, statistics, events);
  const std::atomic<bool> stop{false};
  loop.run(stop);
  writer.end(true);
  const auto outcome = writer.finish();
  EXPECT_EQ(outcome.error_message, "");
  counts = inputs[0].counts();
  return path;
}

SessionReplay::Outcome replay(const std::string& path) {
  auto session = SessionReader::open(path);
  EXPECT_TRUE(session);
  const auto scene = scene_of_session(*session);
  EXPECT_TRUE(scene) << scene.error().sentence;
  auto model = TactileModel::create(scene->model);
  SessionReplay replay(*model);
  SessionChunk chunk;
  for (auto more = session->next(chunk); more && *more; more = session->next(chunk)) {
    replay.take(chunk);
  }
  return replay.finish();
}

TEST(SessionReplay, LateSamplesGapsAndOutagesGiveTheSameSpikes) {
  const TemporaryFolder folder;
  LoopStatistics statistics;
  ProbeInput::Counts counts;
  const std::string path = record_faulty_session(folder, statistics, counts);
  // The session contains the faults to test.
  EXPECT_GT(counts.late, 50U);
  EXPECT_GT(counts.held_ticks, 50U);
  EXPECT_GT(counts.released_ticks, 50U);
  EXPECT_EQ(statistics.gaps.value(), 1U);
  EXPECT_GT(statistics.catch_up_ticks.value(), 0U);

  const auto verdict = replay(path);
  EXPECT_EQ(verdict.difference, "");
  EXPECT_EQ(verdict.ticks, statistics.ticks.value());
  EXPECT_EQ(verdict.spikes, statistics.spikes.value());
  EXPECT_GT(verdict.spikes, 100U);
  EXPECT_EQ(verdict.samples_late, counts.late);
  EXPECT_EQ(verdict.held_ticks, counts.held_ticks);
  EXPECT_EQ(verdict.gaps, 1U);
  EXPECT_GE(verdict.releases, 1U);

  const auto run = run_program({"replay", path});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("bit-identical"), std::string::npos) << run.out;
}

TEST(SessionReplay, ABrokenOffSessionIsComparedUpToItsLastWholeTick) {
  const TemporaryFolder folder;
  LoopStatistics statistics;
  ProbeInput::Counts counts;
  const std::string whole = read_file(record_faulty_session(folder, statistics, counts));
  const std::size_t headers = whole.find("</info>", whole.find(kMarkStreamName)) + 7;
  std::uint64_t ticks_before = 0;
  for (std::size_t part = 1; part <= 20; ++part) {
    const auto verdict = replay(
        folder.file("cut.xdf", whole.substr(0, headers + (whole.size() - headers) / 20 * part)));
    EXPECT_EQ(verdict.difference, "") << part;
    EXPECT_GE(verdict.ticks, ticks_before);
    ticks_before = verdict.ticks;
  }
  EXPECT_GT(ticks_before, 1000U);
}

TEST(SessionReplay, OneChangedBitOfASpikeOrAnInputIsSeen) {
  const TemporaryFolder folder;
  const std::string path = folder.path("s.xdf");
  ASSERT_EQ(run_program({"run", "--fast", "--sink", "xdf:" + path}).exit_code, 0);
  const std::string bytes = read_file(path);
  EXPECT_EQ(replay(path).difference, "");

  auto session = SessionReader::open(path);
  SessionChunk chunk;
  SpikeEvent spike;
  TickRecord pressed;
  for (auto more = session->next(chunk); more && *more; more = session->next(chunk)) {
    if (!chunk.spikes.empty() && spike.neuron == 0) spike = chunk.spikes.back();
    for (const TickRecord& tick : chunk.ticks) {
      if (tick.contact.depth_mm > 0.5 && pressed.number == 0) pressed = tick;
    }
  }
  /// The verdict on a copy with one flipped bit at an offset from a unique pattern.
  const auto changed = [&](std::string_view pattern, std::size_t offset) {
    std::string copy = bytes;
    const std::size_t place = copy.find(pattern);
    EXPECT_NE(place, std::string::npos);
    EXPECT_EQ(copy.find(pattern, place + 1), std::string::npos);
    copy[place + offset] = static_cast<char>(copy[place + offset] ^ 4);
    return replay(folder.file("changed.xdf", copy));
  };
  const std::int64_t time_ns = spike.time.count();
  EXPECT_NE(changed({reinterpret_cast<const char*>(&time_ns), sizeof time_ns}, 0).difference, "");
  // A tick of this probe has its latency, its depth and its delay.
  const std::array<double, 3> tick{0.0, pressed.contact.depth_mm, 0.0};
  const auto verdict =
      changed({reinterpret_cast<const char*>(tick.data()), sizeof tick}, sizeof(double) + 6);
  EXPECT_NE(verdict.difference.find("the recording"), std::string::npos) << verdict.difference;
}

TEST(SessionReplay, ALostTickRecordIsNamed) {
  auto model = TactileModel::create({});
  SessionReplay replay(*model);
  SessionChunk chunk;
  chunk.ticks = {{.time = milliseconds{1}, .number = 1}, {.time = milliseconds{3}, .number = 3}};
  replay.take(chunk);
  const auto verdict = replay.finish();
  EXPECT_NE(verdict.difference.find("tick 2"), std::string::npos) << verdict.difference;
  EXPECT_EQ(verdict.ticks, 1U);
}

TEST(Replay, ASessionHoldsTheMeasuredShapeOfItsTip) {
  const TemporaryFolder folder;
  const std::string shape = folder.file("map.csv", "0.3,0.3,0.3\n0.3,0,inf\n0.3,0.1,0.3\n");
  const std::string scene =
      folder.file("s.toml",
                  "preset = \"goodwin\"\n[probe]\nuri = \"sim:ramp?depth_mm=0.6\"\n"
                  "tip = \"shape\"\nshape = \"map.csv\"\npixel_mm = 0.25\n");
  const std::string session = folder.path("s.xdf");
  const auto run = run_program({"run", scene, "--fast", "--sink", "xdf:" + session});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  ASSERT_TRUE(std::filesystem::remove(shape));
  const auto replay = run_program({"replay", session});
  EXPECT_EQ(replay.exit_code, 0) << replay.err;
  EXPECT_NE(replay.out.find("bit-identical"), std::string::npos) << replay.out;
}

TEST(Replay, ARunWithSeedForceAndTwoProbesIsReplayedFromItsSessionAlone) {
  const TemporaryFolder folder;
  const std::string scene =
      folder.file("scene.toml",
                  "[[probe]]\nuri = \"sim:taps?interval_s=0.2&tap_s=0.1\"\n"
                  "radius_mm = 3\nx_mm = 9\n"
                  "[[probe]]\nuri = \"sim:sine?dropouts_per_s=3\"\nx_mm = 21\n"
                  "[transduction]\nlambda_kPa = 0.2 # ü & <\n");
  const std::string path = folder.path("s.xdf");
  const auto run = run_program({"run", scene, "--fast", "--seed", "9", "--sink", "xdf:" + path,
                                "--sink", "csv:" + folder.path("live.csv"), "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  std::filesystem::remove(scene);
  const auto again =
      run_program({"replay", path, "--json", "--sink", "csv:" + folder.path("again.csv"), "--sink",
                   "xdf:" + folder.path("again.xdf")});
  EXPECT_EQ(again.exit_code, 0) << again.out;
  EXPECT_EQ(run_program({"replay", folder.path("again.xdf")}).exit_code, 0);
  const auto verdict = nlohmann::json::parse(again.out);
  EXPECT_TRUE(verdict["bit_identical"].get<bool>());
  EXPECT_EQ(verdict["spikes"], nlohmann::json::parse(run.out)["spikes"]);
  EXPECT_GT(verdict["spikes"].get<int>(), 0);
  const std::string live = read_file(folder.path("live.csv"));
  EXPECT_EQ(read_file(folder.path("again.csv")), live);

  ASSERT_EQ(run_program({"export", path, "--sink", "csv:" + folder.path("export.csv"), "--sink",
                         "xdf:" + folder.path("copy.xdf")})
                .exit_code,
            0);
  EXPECT_EQ(read_file(folder.path("export.csv")), live);
  EXPECT_EQ(run_program({"replay", folder.path("copy.xdf")}).exit_code, 0);
}

/// Of a live run, the first sample is not where the first tick begins.
TEST(Replay, ATraceExportedFromASessionHasTheTicksOfItsRun) {
  const TemporaryFolder folder;
  std::string trace = "# time_offset_ns=0\n# start_device_ns=0\ntime_s,depth_mm\n";
  for (int i = 0; i < 600; ++i) {
    const double depth_mm = i < 100 ? 0.0 : std::min(1.5, 0.05 * (i - 100));
    trace += std::to_string(0.00075 + 0.001 * i) + "," + std::to_string(depth_mm) + "\n";
  }
  const std::string session = folder.path("s.xdf");
  const auto spikes_of = [&](const std::string& file) {
    const auto run =
        run_program({"run", "--fast", "--probe", "replay:" + file, "--sink",
                     "csv:" + folder.path("s.csv"), "--sink", "xdf:" + session, "--overwrite"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return read_file(folder.path("s.csv"));
  };
  const std::string recorded = spikes_of(folder.file("t.csv", trace));
  EXPECT_GT(recorded.size(), 200U);
  const std::string copy = folder.path("copy.csv");
  ASSERT_EQ(run_program({"export", session, "--sink", "trace:" + copy}).exit_code, 0);
  EXPECT_EQ(spikes_of(copy), recorded);
}

TEST(Replay, EverySeedOfTheCommandLineIsInTheSession) {
  const TemporaryFolder folder;
  // Noisy neurons, and adaptation with spread.
  const std::string scene =
      folder.file("s.toml", "preset = \"goodwin\"\n[afferent]\ngain_spread = 0.3\n");
  const std::string path = folder.path("s.xdf");
  const auto run =
      run_program({"run", scene, "--fast", "--seed", "7", "--sink", "xdf:" + path, "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_GT(nlohmann::json::parse(run.out)["spikes"].get<int>(), 10);
  const auto again = run_program({"replay", path});
  EXPECT_EQ(again.exit_code, 0) << again.out << again.err;
}

TEST(Replay, RefusesWhatCannotBeReplayed) {
  const TemporaryFolder folder;
  EXPECT_EQ(run_program({"replay", folder.path("none.xdf")}).exit_code, 2);
  EXPECT_EQ(run_program({"replay", "tests/traces/taps.csv"}).exit_code, 2);
  EXPECT_EQ(run_program({"export", "tests/traces/taps.csv", "--sink", "csv:-"}).exit_code, 2);
}

}  // namespace
}  // namespace merkel
