#include <algorithm>
#include <sstream>
#include <thread>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "drivers/protocols/trace_file.hpp"
#include "drivers/sessions/session_reader.hpp"
#include "tests/drivers/simulation/running_device.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/text_has.hpp"
#include "tests/tools/program.hpp"
#include "tools/connect/hand_scene.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;

/// A grasp as a trace with a column for each finger.
std::string record_grasp(const TemporaryFolder& folder, const std::string& options) {
  const std::string trace = folder.path("hand.csv");
  const auto run = run_program({"record", "sim:grasp?" + options, trace});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  return trace;
}

/// A simulated hand on one cable.
DeviceSimulator::Settings cable(const std::string& trace, const SimulatedFaults& faults = {},
                                std::string link = {}, std::string_view protocol = "csv") {
  auto reader = TraceReader::open(trace);
  EXPECT_TRUE(reader) << reader.error().sentence;
  constexpr std::size_t kMax = 100'000;
  Readings readings(ReadingColumns(reader->columns()), kMax);
  EXPECT_TRUE(reader->read(readings, kMax));
  std::vector<ProbeSample> samples;
  std::vector<double> others;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    samples.push_back(*readings.sample(i));
    others.insert(others.end(), readings.further(i).begin(), readings.further(i).end());
  }
  return {.protocol = *find_protocol(protocol),
          .trace = std::move(samples),
          .extra_columns = reader->extra_columns(),
          .others = std::move(others),
          .baud = (*find_protocol(protocol))->baud,
          .link = std::move(link),
          .faults = faults};
}

/// The example of a hand, on another device.
std::string example_on(const TemporaryFolder& folder, const std::string& uri,
                       const std::string& more = {}) {
  std::string scene = read_file("tools/examples/hand_electrodes.toml");
  const std::string simulated = "sim:grasp?count=1000";
  const auto place = scene.find("\"" + simulated);
  EXPECT_NE(place, std::string::npos);
  scene.replace(place + 1, simulated.size(), uri);
  return folder.file("hand.toml", scene + more);
}

TEST(Hand, AChannelIsPlacedByAWholeWordOfItsName) {
  const auto patch_of = [](const std::string& name) {
    const auto placed = place_on_hand({{.name = name}});
    return placed.at(0).by_name ? placed.at(0).patch : "";
  };
  for (const char* const name : {"ring_N", "Ring2_N", "left_ring_N", "RHRing_N", "ringForce_N",
                                 "RING_1_N", "ringfinger_N", "ringFingertip_N", "hand.ring_N"}) {
    EXPECT_EQ(patch_of(name), "ring") << name;
  }
  EXPECT_EQ(patch_of("mid_N"), "middle");
  EXPECT_EQ(patch_of("thumbTip_N"), "thumb");
  EXPECT_EQ(patch_of("lTHUMB_N"), "thumb");
  for (const char* const name : {"string1_N", "spring_N", "humid_N", "Spring_N", "SPRING_N",
                                 "handle_N", "tip_N", "finger_N"}) {
    EXPECT_EQ(patch_of(name), "") << name;
  }
}

/// The summary of a live run that failed by what a busy host costs only.
nlohmann::json live_summary(const ProgramRun& run) {
  auto json = nlohmann::json::parse(run.out);
  for (const auto& finding : json["verdict"]) {
    if (finding["severity"] != "failure") continue;
    EXPECT_TRUE(finding["kind"] == "skipped" || finding["kind"] == "touch_lost") << run.err;
  }
  return json;
}

TEST(Hand, ADeviceThatFeedsNoProbeIsRefused) {
  const TemporaryFolder folder;
  const std::string devices = "[[device]]\nname = \"hand\"\nuri = \"sim:grasp\"\n";
  const std::string scene = folder.file("s.toml", devices + "[[probe]]\nuri = \"sim:ramp\"\n");
  EXPECT_TRUE(has(run_program({"run", scene}).err,
                  "s.toml:2: device.name \"hand\" feeds no probe: set the key device of a "
                  "[[probe]] to it, or remove it\n"));
  // With another probe on the command line it is used no more, in its session too.
  const std::string used =
      folder.file("used.toml", devices + "[[probe]]\ndevice = \"hand\"\ndepth = \"thumb_mm\"\n");
  const std::string session = folder.path("s.xdf");
  const auto run = run_program({"run", used, "--fast", "--probe", "sim:ramp", "--duration-s", "0.3",
                                "--sink", "xdf:" + session});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run_program({"replay", session}).exit_code, 0);
}

TEST(Hand, TheExampleRunsOnOneCable) {
  const TemporaryFolder folder;
  RunningDevice hand(cable(record_grasp(folder, "count=30&rate_hz=500")));
  const std::string scene = example_on(folder, hand.uri());
  const std::string session = folder.path("s.xdf");
  const std::string commands = folder.path("stim.csv");
  const auto run = run_program({"run", scene, "--duration-s", "2.5", "--json", "--sink",
                                "xdf:" + session + "?frames=1", "--sink", "stim-csv:" + commands});
  const auto json = live_summary(run);
  ASSERT_EQ(json["probes"].size(), 6U);
  for (const auto& probe : json["probes"]) {
    EXPECT_GT(probe["deepest_press"]["depth_mm"], 0.9) << probe["uri"];
    EXPECT_EQ(probe["samples_in"], json["probes"][0]["samples_in"]);
  }
  EXPECT_TRUE(has(json["probes"][5]["uri"], "#depth=palm_mm"));
  // One device: its counts stand once.
  EXPECT_GT(json["probes"][0]["samples_in"], 250);
  EXPECT_GE(json["probes"][0]["device"]["readings"], json["probes"][0]["samples_in"]);
  EXPECT_TRUE(json["probes"][1]["device"].is_null());
  EXPECT_LT(json["device_readings"].get<int>(), 2 * json["probes"][0]["samples_in"].get<int>());
  for (const char* const electrode : {"thumb-1", "index-2", "middle-1", "palm-3"}) {
    EXPECT_TRUE(has(read_file(commands), electrode)) << electrode;
  }

  // One stream of its bytes, and the same spikes again.
  auto read = SessionReader::open(session);
  ASSERT_TRUE(read);
  std::vector<std::size_t> samples(6);
  std::size_t frames = 0;
  for (SessionChunk chunk; read->next(chunk).value_or(false);) {
    for (const auto& each : chunk.frames) {
      EXPECT_EQ(each.probe, 0U);
      ++frames;
    }
    for (const auto& each : chunk.samples) ++samples.at(each.probe);
  }
  EXPECT_GT(frames, 100U);
  for (const std::size_t count : samples) EXPECT_EQ(count, samples[0]);
  const auto replay = run_program({"replay", session});
  EXPECT_EQ(replay.exit_code, 0) << replay.out << replay.err;
}

TEST(Hand, ItsFirmwareNamesTheChannels) {
  const TemporaryFolder folder;
  const std::string trace = record_grasp(folder, "count=30&rate_hz=500");
  RunningDevice hand(cable(trace, {}, {}, "hbf1"));
  EXPECT_EQ(hand.uri().find("columns"), std::string::npos) << hand.uri();
  const auto run =
      run_program({"run", example_on(folder, hand.uri()), "--duration-s", "2.5", "--json"});
  const auto json = live_summary(run);
  ASSERT_EQ(json["probes"].size(), 6U);
  for (const auto& probe : json["probes"]) {
    EXPECT_GT(probe["deepest_press"]["depth_mm"], 0.9) << probe["uri"];
  }
}

TEST(Hand, UnpluggingReleasesAllItsProbesInTheSameTick) {
  const TemporaryFolder folder;
  RunningDevice hand(cable(record_grasp(folder, "count=30&rate_hz=500"),
                           {.unplug_at = milliseconds{2500}, .unplug_for = milliseconds{400}},
                           folder.path("tty")));
  std::string scene = "[[device]]\nname = \"hand\"\nuri = \"" + hand.uri() + "\"\n";
  for (const char* const channel : {"\"thumb_mm\"", "\"index\"", "5"}) {
    scene += std::string("[[probe]]\ndevice = \"hand\"\ndepth = ") + channel + "\n";
  }
  const std::string session = folder.path("s.xdf");
  const auto run = run_program({"run", folder.file("s.toml", scene), "--duration-s", "4.5",
                                "--json", "--sink", "xdf:" + session});
  const auto json = nlohmann::json::parse(run.out);
  auto read = SessionReader::open(session);
  ASSERT_TRUE(read);
  std::vector<std::vector<std::uint64_t>> released(3);
  for (SessionChunk chunk; read->next(chunk).value_or(false);) {
    for (const TickRecord& tick : chunk.ticks) {
      if (tick.state == TickRecord::State::kReleased) {
        released.at(tick.probe).push_back(tick.number);
      }
    }
  }
  EXPECT_GT(released[0].size(), 100U);
  for (const auto& ticks : released) EXPECT_EQ(ticks, released[0]);
  EXPECT_EQ(json["probes"][0]["device"]["outages"], 1);
  EXPECT_EQ(json["device_outages"], 1);
  EXPECT_EQ(run_program({"replay", session}).exit_code, 0);
}

TEST(Hand, ARecordingOfAWholeHandGivesTheSpikesOfTheSimulation) {
  const TemporaryFolder folder;
  const std::string trace = record_grasp(folder, "count=1&rate_hz=200");
  const std::string a = folder.path("a.csv");
  const std::string b = folder.path("b.csv");
  const auto simulated = run_program(
      {"run", example_on(folder, "sim:grasp?count=1&rate_hz=200"), "--fast", "--sink", "csv:" + a});
  ASSERT_EQ(simulated.exit_code, 0) << simulated.err;
  const auto replayed =
      run_program({"run", example_on(folder, "replay:" + trace), "--fast", "--sink", "csv:" + b});
  ASSERT_EQ(replayed.exit_code, 0) << replayed.err;
  EXPECT_GT(read_file(a).size(), 1000U);
  EXPECT_EQ(read_file(a), read_file(b));
}

TEST(Hand, OneSessionServesAllProbes) {
  const TemporaryFolder folder;
  const std::string a = folder.path("a.csv");
  const std::string b = folder.path("b.csv");
  const std::string session = folder.path("grasp.xdf");
  const std::string scene = "tools/examples/hand_electrodes.toml";
  const auto run = run_program({"run", scene, "--fast", "--duration-s", "1", "--sink", "csv:" + a,
                                "--sink", "xdf:" + session});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto again = run_program({"run", scene, "--fast", "--probe", "replay:" + session,
                                  "--duration-s", "1", "--sink", "csv:" + b});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_GT(read_file(a).size(), 1000U);
  EXPECT_EQ(read_file(a), read_file(b));
  // Of another number of probes, it says how.
  const std::string two = folder.file("two.toml", "[[probe]]\n[[probe]]\n");
  const auto refused = run_program({"run", two, "--fast", "--probe", "replay:" + session});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_TRUE(has(refused.err, "holds the samples of 6 probes, but the scene has 2"))
      << refused.err;
  const auto each =
      run_program({"run", two, "--fast", "--duration-s", "0.2", "--probe",
                   "replay:" + session + "?probe=0", "--probe", "replay:" + session + "?probe=1"});
  EXPECT_EQ(each.exit_code, 0) << each.err;
}

TEST(Hand, ARecordingWithoutSomeValuesHasTheSpikesOfTheLiveRun) {
  const TemporaryFolder folder;
  // More rows than wait at once; of the second sensor one in a hundred has no value, or all.
  const auto run_with = [&](auto lacks, bool alone = false) {
    std::string rows = "time_s,thumb_N,palm_N\n";
    for (int k = 0; k < 12000; ++k) {
      const bool pressed = k % 6000 < 300;
      rows += std::to_string(k / 1e3) + ",0," + (lacks(k) ? "" : pressed ? "0.15" : "0") + "\n";
    }
    const std::string replay = "replay:" + folder.file("t.csv", rows);
    std::vector<std::string> words{"run",    "goodwin", "--fast",
                                   "--json", "--probe", replay + "#palm_N"};
    if (!alone) words.insert(words.end(), {"--probe", replay + "#thumb_N"});
    const auto run = run_program(words);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return nlohmann::json::parse(run.out);
  };
  const auto whole = run_with([](int) { return false; });
  EXPECT_GT(whole["spikes"], 0);
  EXPECT_EQ(run_with([](int k) { return k % 100 == 50; })["spikes"], whole["spikes"]);
  for (const bool alone : {false, true}) {
    const auto away = run_with([](int k) { return k >= 250 && k < 11000; }, alone);
    EXPECT_EQ(away["probes"][0]["released_ticks"], 10700) << alone;
    EXPECT_EQ(away["probes"][0]["samples_in"], 1250) << alone;
  }
}

TEST(Hand, TheCommandLineChoosesChannelsAfterASharp) {
  const TemporaryFolder folder;
  const std::string trace = record_grasp(folder, "count=30&force_N=0.4&rate_hz=200");
  RunningDevice hand(cable(trace));
  const auto run = run_program({"run", "goodwin", "--probe", hand.uri() + "#palm_N", "--probe",
                                hand.uri() + "#force=index", "--duration-s", "1", "--json"});
  const auto json = live_summary(run);
  ASSERT_EQ(json["probes"].size(), 2U);
  EXPECT_EQ(json["probes"][0]["samples_in"], json["probes"][1]["samples_in"]);
  EXPECT_GT(json["probes"][1]["deepest_press"]["force_N"], 0.3);

  // The sentence says how, and it works.
  const std::string replay = "replay:" + trace;
  const auto unnamed = run_program({"run", "--fast", "--probe", replay});
  EXPECT_EQ(unnamed.exit_code, 2);
  EXPECT_TRUE(has(unnamed.err, "by #thumb_N at the end")) << unnamed.err;
  EXPECT_EQ(run_program({"run", "--fast", "--probe", replay + "#thumb_N"}).exit_code, 0);
  const auto misspelt = run_program({"run", "--fast", "--probe", replay + "#thmb_N"});
  EXPECT_EQ(misspelt.exit_code, 2);
  EXPECT_TRUE(has(misspelt.err, "did you mean thumb_N?")) << misspelt.err;
  const auto length = run_program({"run", "--fast", "--probe", replay + "#depth=thumb_N"});
  EXPECT_TRUE(has(length.err, "is a force and cannot be the depth")) << length.err;
}

TEST(Hand, EachProbeHasItsOwnCalibration) {
  const TemporaryFolder folder;
  const std::string trace = record_grasp(folder, "count=1&force_N=0.4&rate_hz=200&wait_s=60");
  RunningDevice hand(cable(trace));
  // A tare of one channel, as merkel calibrate writes it.
  const std::string tare = folder.path("thumb.toml");
  const auto calibrated =
      run_program({"calibrate", hand.uri() + "#thumb_N", tare, "--seconds", "0.2"});
  ASSERT_EQ(calibrated.exit_code, 0) << calibrated.err;
  EXPECT_TRUE(has(read_file(tare), "source = \"thumb_N\"")) << read_file(tare);
  static_cast<void>(
      folder.file("double.toml", "[force]\nsource = \"index_N\"\ngain = 2.0\nzero = -0.05\n"));
  const auto scene = [&](const std::string& of_thumb) {
    return folder.file("s.toml", "preset = \"goodwin\"\n[[device]]\nname = \"hand\"\nuri = \"" +
                                     hand.uri() +
                                     "\"\n[[probe]]\ndevice = \"hand\"\nforce = \"thumb\"\n"
                                     "calibration = \"" +
                                     of_thumb +
                                     "\"\n[[probe]]\ndevice = \"hand\"\nforce = \"index\"\n"
                                     "x_mm = 25\ncalibration = \"double.toml\"\n");
  };
  const auto run = run_program({"run", scene("thumb.toml"), "--duration-s", "0.5", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto json = nlohmann::json::parse(run.out);
  EXPECT_EQ(json["probes"][0]["deepest_press"]["force_N"], 0.0);
  EXPECT_NEAR(json["probes"][1]["deepest_press"]["force_N"].get<double>(), 0.1, 1e-6);
  const auto other = run_program({"run", scene("double.toml"), "--duration-s", "0.5"});
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_TRUE(
      has(other.err, "belongs to the channel index_N, but the force of this probe is thumb_N"))
      << other.err;
}

TEST(Hand, AProtocolWithoutSuchChannelsSaysSo) {
  const TemporaryFolder folder;
  const std::string trace = record_grasp(folder, "count=1");
  const auto run = run_program({"simulate-probe", "mark10", "--trace", trace});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_TRUE(has(run.err, "only those of csv and hbf1 send columns of other names")) << run.err;
  RunningDevice gauge("hbf1", {});
  const auto chosen =
      run_program({"run", "--probe", gauge.uri() + "#thumb_N", "--duration-s", "0.1"});
  EXPECT_TRUE(has(chosen.err, "The device has force_N, depth_mm")) << chosen.err;
  EXPECT_EQ(
      run_program({"run", "--probe", gauge.uri() + "#force_N", "--duration-s", "0.1"}).exit_code,
      0);
}

}  // namespace
}  // namespace merkel
