#include <algorithm>
#include <cmath>
#include <regex>
#include <sstream>
#include <thread>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "drivers/files/csv_text.hpp"
#include "drivers/protocols/trace_file.hpp"
#include "drivers/sinks/open_sink.hpp"
#include "tests/drivers/simulation/line_printer.hpp"
#include "tests/drivers/simulation/running_device.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/text_has.hpp"
#include "tests/tools/program.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

// A jitter buffer so long that no tick is late, even on a machine that stands still for a second.
const std::string kNeverLate =
    "[probe]\ndelay_ms = 2000\n[loop]\nmax_catch_up_ticks = 1000000\nstale_after_ms = ";
// Nor is a press released.
const std::string kPatientScene = kNeverLate + "1500\n";
constexpr const char* kDuration = "0.8";

struct DeviceRun {
  std::string spikes;
  std::string replayed;
  nlohmann::json summary;
  std::string err;
};

/// A spike file without its leading comments.
std::string rows_of_spikes(const std::string& file) {
  return file.substr(file.find("time_s,neuron"));
}

/// Runs the program with a device, and again with the trace that the run has recorded.
DeviceRun run_and_replay(const std::string& uri, const std::string& scene_text = kPatientScene,
                         const char* duration_s = kDuration) {
  const TemporaryFolder folder;
  const std::string scene = folder.file("s.toml", scene_text);
  DeviceRun result;
  const auto live =
      run_program({"run", scene, "--probe", uri, "--record", folder.path("t.csv"), "--sink",
                   "csv:" + folder.path("live.csv"), "--duration-s", duration_s, "--json"});
  EXPECT_NE(live.exit_code, 2) << live.err;
  if (live.out.empty()) return result;
  result.err = live.err;
  result.summary = nlohmann::json::parse(live.out);
  // A busy host may be slow to see that a device is back.
  const bool long_outage = result.summary["device_outage_ns"] > 1'000'000'000;
  EXPECT_EQ(live.exit_code, long_outage ? 1 : 0) << live.err;
  result.spikes = rows_of_spikes(read_file(folder.path("live.csv")));
  const auto replay =
      run_program({"run", scene, "--fast", "--probe", "replay:" + folder.path("t.csv"), "--sink",
                   "csv:" + folder.path("replay.csv"), "--duration-s", duration_s});
  EXPECT_EQ(replay.exit_code, 0) << replay.err;
  result.replayed = rows_of_spikes(read_file(folder.path("replay.csv")));
  return result;
}

class EveryDevice : public testing::TestWithParam<std::string_view> {};

TEST_P(EveryDevice, SpikesAreThoseOfTheReplayOfWhatWasRead) {
  RunningDevice device(GetParam(), {});
  const DeviceRun run = run_and_replay(device.uri());
  ASSERT_FALSE(run.summary.is_null());
  const auto& probe = run.summary["probes"][0];
  EXPECT_EQ(probe["late"], 0);
  // On a busy machine, requests may time out; streaming devices lose nothing.
  const bool asked = GetParam() == "esm" || GetParam() == "grbl" || GetParam() == "zaber";
  EXPECT_TRUE(asked || probe["device"]["lost"] == 0);
  EXPECT_EQ(probe["device"]["damaged"], 0);
  EXPECT_EQ(probe["device"]["refused"], 0);
  EXPECT_EQ(run.summary["gaps"], 0);
  EXPECT_GT(run.spikes.size(), asked ? 5U : 40U);
  EXPECT_EQ(run.spikes, run.replayed);
}

std::vector<std::string_view> names() {
  std::vector<std::string_view> names;
  for (const ProtocolEntry& entry : protocol_table()) names.push_back(entry.name);
  return names;
}

INSTANTIATE_TEST_SUITE_P(Devices, EveryDevice, testing::ValuesIn(names()),
                         [](const auto& entry) { return std::string(entry.param); });

/// Spikes with their times since a start, in ns.
std::vector<std::pair<std::int64_t, std::string>> rows_since(const std::string& spikes,
                                                             nanoseconds start) {
  std::vector<std::pair<std::int64_t, std::string>> rows;
  std::istringstream lines(spikes);
  std::string line;
  std::getline(lines, line);
  while (std::getline(lines, line)) {
    const auto comma = line.find(',');
    const auto time = parse_seconds(std::string_view(line).substr(0, comma));
    rows.emplace_back((*time - start).count(), line.substr(comma));
  }
  return rows;
}

TEST(Devices, TheSpikesAreThoseOfTheTraceThatTheDevicePlays) {
  const TemporaryFolder folder;
  auto press = dyadic_press(2000);
  std::vector<DeliveredSample> delivered;
  for (ProbeSample& sample : press) {
    sample.channels = ProbeSample::kDepth;
    delivered.push_back({.sample = sample});
  }
  auto sink = open_sink("trace:" + folder.path("press.csv"), 0, false);
  ASSERT_TRUE(sink && (*sink)->write({.samples = delivered}) && (*sink)->close());
  RunningDevice device(DeviceSimulator::Settings{.protocol = *find_protocol("hbf1"),
                                                 .trace = press,
                                                 .baud = 500000,
                                                 .faults = {.split = true}});
  const DeviceRun live = run_and_replay(device.uri() + "&clock=device");
  ASSERT_FALSE(live.summary.is_null());
  ASSERT_EQ(live.summary["probes"][0]["late"], 0);
  const auto replay = run_program({"run", folder.file("s.toml", kPatientScene), "--fast", "--probe",
                                   "replay:" + folder.path("press.csv"), "--sink",
                                   "csv:" + folder.path("s.csv"), "--duration-s", kDuration});
  ASSERT_EQ(replay.exit_code, 0) << replay.err;
  const auto expected = rows_since(rows_of_spikes(read_file(folder.path("s.csv"))), nanoseconds{0});
  EXPECT_GT(expected.size(), 5U);
  EXPECT_EQ(rows_since(live.spikes, nanoseconds{0}), expected);
}

TEST(Devices, AnUnpluggedDeviceIsReleasedAndTheRunGoesOn) {
  const TemporaryFolder folder;
  RunningDevice device("hbf1", {.unplug_at = milliseconds{300}, .unplug_for = milliseconds{600}},
                       folder.path("tty"));
  const DeviceRun run = run_and_replay(device.uri(), kNeverLate + "400\n", "2.5");
  ASSERT_FALSE(run.summary.is_null());
  const auto& probe = run.summary["probes"][0];
  EXPECT_EQ(probe["device"]["outages"], 1);
  EXPECT_EQ(probe["releases"], 1);
  EXPECT_GT(probe["device"]["lost"], 100);
  EXPECT_NE(run.err.find("is disconnected"), std::string::npos);
  EXPECT_TRUE(std::regex_search(run.err, std::regex("is back after [01][.][0-9]+ s\n"))) << run.err;
  EXPECT_EQ(run.spikes, run.replayed);
}

TEST(Devices, ARecordingEndsAfterItsDurationThoughTheDeviceIsGone) {
  const TemporaryFolder folder;
  RunningDevice device("hbf1",
                       {.unplug_at = milliseconds{200}, .unplug_for = milliseconds{3'600'000}},
                       folder.path("tty"));
  const auto begin = std::chrono::steady_clock::now();
  const auto run =
      run_program({"record", device.uri(), folder.path("t.csv"), "--duration-s", "0.5", "--json"});
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds{30});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.err.find("is disconnected"), std::string::npos) << run.err;
  EXPECT_GT(nlohmann::json::parse(run.out)["samples"], 20);
}

TEST(Devices, ADeviceThatFailsDuringARunIsNoWrongInput) {
  const TemporaryFolder folder;
  std::string rows = "time_s,force_N\n";
  for (int k = 0; k < 1200; ++k) rows += std::to_string(1e-3 * k) + ",0.3\n";
  const std::string broken = folder.file("t.csv", rows + "1.3,nonsense\n");
  const std::string live = "replay:" + broken + "?live=1";
  const auto recording = run_program({"run", "--fast", "--probe", "replay:" + broken});
  EXPECT_EQ(recording.exit_code, 2) << recording.err;
  const auto device =
      run_program({"run", "--probe", "fused:" + live + "|sim:ramp?hold_s=9&live=1"});
  EXPECT_EQ(device.exit_code, 1) << device.err;
  for (const std::string& err : {recording.err, device.err}) {
    EXPECT_NE(err.find("t.csv:1202"), std::string::npos) << err;
  }
}

TEST(Devices, AnErrorAtTheStartIsOneSentenceWithItsExitCode) {
  RunningDevice device("csv", {});
  const std::vector<std::tuple<std::string, std::string, int>> cases = {
      {device.uri() + "&baud=9600&timeout_ms=500", "not csv readings", 3},
      {"serial:/dev/ttyNONE?protocol=hbf1", "there is no device", 3},
      {"serial:/dev/ttyNONE?protocol=hbf2", "did you mean hbf1", 2},
      {"serial:/dev/ttyNONE?protocol=csv&columns=force_stone", "forces are in N", 2},
  };
  for (const auto& [uri, sentence, code] : cases) {
    const auto run = run_program({"run", "--probe", uri, "--duration-s", "0.1"});
    EXPECT_EQ(run.exit_code, code) << uri;
    EXPECT_NE(run.err.find(sentence), std::string::npos) << run.err;
    EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
  }
}

TEST(Devices, SimulateProbePrintsTheUriAndRecordReadsIt) {
  const TemporaryFolder folder;
  std::jthread device([&] {
    const std::string depth = folder.file("depth.csv", "time_s,depth_mm\n0,0\n1,1\n");
    const auto run =
        run_program({"simulate-probe", "mark10", "--trace", depth, "--duration-s", "9"});
    EXPECT_EQ(run.exit_code, 2);  // a gauge measures force
    EXPECT_NE(run.err.find("the trace has no force"), std::string::npos);
  });
  std::jthread stage([&] {
    const auto run = run_program({"simulate-probe", "zaber", "--trace", "tests/traces/taps.csv",
                                  "--link", folder.path("tty"), "--duration-s", "2.5"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_NE(run.out.find("serial:" + folder.path("tty") + "?protocol=zaber&um_per_step="),
              std::string::npos);
    EXPECT_NE(run.err.find("samples generated"), std::string::npos);
  });
  for (int k = 0; k < 300 && !std::filesystem::exists(folder.path("tty")); ++k) {
    std::this_thread::sleep_for(milliseconds{10});
  }
  const auto run = run_program(
      {"record",
       "serial:" + folder.path("tty") + "?protocol=zaber&um_per_step=0.9765625&rate_hz=100",
       folder.path("t.csv"), "--duration-s", "0.5"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  auto trace = TraceReader::open(folder.path("t.csv"));
  ASSERT_TRUE(trace);
  std::vector<ProbeSample> samples(200);
  EXPECT_GE(*trace->read(samples), 20U);
}

TEST(Devices, CalibrateWritesAFileThatTheUriCanName) {
  const TemporaryFolder folder;
  std::vector<ProbeSample> trace = dyadic_press(20'000);
  for (ProbeSample& sample : trace) sample.force_mN = 500.0;
  RunningDevice device(DeviceSimulator::Settings{
      .protocol = *find_protocol("hbf1"), .trace = trace, .baud = 500000});
  const auto tare = run_program({"calibrate", device.uri(), folder.path("c.toml"), "--points",
                                 "0.25", "--seconds", "0.1", "--saturation", "40"});
  EXPECT_EQ(tare.exit_code, 0) << tare.err;
  EXPECT_NE(tare.out.find("zero 0.25 N"), std::string::npos) << tare.out;
  const std::string text = read_file(folder.path("c.toml"));
  EXPECT_NE(text.find("serial_number = \"SIM1\""), std::string::npos);
  EXPECT_NE(text.find("saturation = 40.0"), std::string::npos);

  const auto record = run_program({"record", device.uri() + "&calibration=" + folder.path("c.toml"),
                                   folder.path("t.csv"), "--duration-s", "0.05", "--json"});
  EXPECT_EQ(record.exit_code, 0) << record.err;
  const auto summary = nlohmann::json::parse(record.out);
  EXPECT_GE(summary["samples"], 10);
  EXPECT_GE(summary["device"]["readings"], summary["samples"]);
  EXPECT_EQ(summary["device"]["damaged"], 0);
  auto reader = TraceReader::open(folder.path("t.csv"));
  ASSERT_TRUE(reader);
  std::vector<ProbeSample> samples(10);
  ASSERT_EQ(*reader->read(samples), 10U);
  for (const ProbeSample& sample : samples) EXPECT_EQ(sample.force_mN, 250.0);

  const auto same = run_program(
      {"calibrate", device.uri(), folder.path("d.toml"), "--points", "0,1", "--seconds", "0.1"});
  EXPECT_EQ(same.exit_code, 1);
  EXPECT_NE(same.err.find("differ by less"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(folder.path("d.toml")));
  const auto pinned = run_program({"calibrate", device.uri(), folder.path("f.toml"), "--seconds",
                                   "0.1", "--saturation", "0.5"});
  EXPECT_EQ(pinned.exit_code, 1);
  EXPECT_NE(pinned.err.find("at the end of its range"), std::string::npos) << pinned.err;
  const auto recording = run_program({"calibrate", "sim:ramp", folder.path("e.toml")});
  EXPECT_EQ(recording.exit_code, 2);
  EXPECT_NE(recording.err.find("only a device can be calibrated"), std::string::npos);
}

TEST(Devices, EachCommandThatMeasuresReportsADeviceThatGoes) {
  const TemporaryFolder folder;
  const SimulatedFaults unplugged{.unplug_at = milliseconds{500},
                                  .unplug_for = milliseconds{60'000}};
  for (const bool doctor : {false, true}) {
    RunningDevice device("hbf1", unplugged, folder.path("tty"));
    const auto run = run_program(
        doctor ? std::vector<std::string>{"doctor", "--probe", device.uri(), "--seconds", "3"}
               : std::vector<std::string>{"calibrate", device.uri(), folder.path("c.toml"),
                                          "--points", "0,1", "--seconds", "2"});
    EXPECT_TRUE(has(run.err, " is disconnected")) << doctor << run.err;
    EXPECT_TRUE(doctor || has(run.err, "check that the device sends")) << run.err;
  }
}

TEST(Devices, ARunThatLostTouchSaysSoAndFails) {
  // The device stalls for most of the run.
  RunningDevice device("hbf1", {.stall_at = milliseconds{300}, .stall_for = milliseconds{60'000}});
  const auto run = run_program({"run", "--probe", device.uri(), "--duration-s", "3", "--json"});
  EXPECT_EQ(run.exit_code, 1) << run.out;
  const auto verdict = nlohmann::json::parse(run.out)["verdict"];
  ASSERT_FALSE(verdict.empty());
  EXPECT_EQ(verdict[0]["severity"], "failure");
  EXPECT_NE(verdict[0]["finding"].get<std::string>().find("touch was lost"), std::string::npos);
}

TEST(Devices, ForceAndDepthAreComparedWhereBothAreMeasured) {
  const TemporaryFolder folder;
  const std::string both = "sim:ramp?depth_mm=1&force_N=0.9&hold_s=0.2";
  const auto run = run_program({"run", "--fast", "--probe", both, "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto json = nlohmann::json::parse(run.out);
  const auto& compared = json["probes"][0]["force_and_depth"];
  EXPECT_NEAR(compared["force_N"], 0.9, 1e-6);
  EXPECT_NEAR(compared["model_force_N"], 0.2468, 1e-3);
  EXPECT_NEAR(compared["ratio"], 0.9 / 0.2468, 0.05);
  ASSERT_FALSE(json["verdict"].empty());
  EXPECT_NE(json["verdict"][0]["finding"].get<std::string>().find("ratio 3.6"), std::string::npos);
  // Force drives, unless the scene selects depth.
  EXPECT_NEAR(json["probes"][0]["deepest_press"]["force_N"], 0.9, 1e-6);
  const std::string scene = folder.file("s.toml", "[probe]\ncontrol = \"depth\"\n");
  const auto depth = run_program({"run", scene, "--fast", "--probe", both, "--json"});
  EXPECT_NEAR(nlohmann::json::parse(depth.out)["probes"][0]["deepest_press"]["depth_mm"], 1.0,
              1e-6);
}

TEST(Devices, APressBeyondTheLimitIsRefusedUnlessTheLimitIsRaised) {
  const TemporaryFolder folder;
  const std::string hard = "sim:ramp?force_N=113&hold_s=0.1";
  const auto refused = run_program({"run", "--fast", "--probe", hard});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("[probe] max_force_N"), std::string::npos) << refused.err;
  const std::string scene = folder.file("s.toml", "[probe]\nmax_force_N = 120\n");
  EXPECT_EQ(run_program({"run", scene, "--fast", "--probe", hard}).exit_code, 0);
}

TEST(Devices, APressOutsideThePatchGetsAWarning) {
  const auto run =
      run_program({"run", "--fast", "--probe", "sim:ramp?x_mm=55&hold_s=0.1", "--strict"});
  EXPECT_EQ(run.exit_code, 0);  // the run succeeded
  EXPECT_NE(run.out.find("outside the patch"), std::string::npos) << run.out;
}

TEST(Devices, ARecordingIsNotReleasedForBeingSparse) {
  const TemporaryFolder folder;
  const std::string trace = folder.file("t.csv", "time_s,depth_mm\n0,1\n1,1\n");
  const auto run = run_program({"run", "--fast", "--probe", "replay:" + trace, "--json"});
  const auto json = nlohmann::json::parse(run.out);
  EXPECT_EQ(json["probes"][0]["released_ticks"], 0);
  const std::string scene = folder.file("s.toml", "[loop]\nstale_after_ms = 50\n");
  const auto requested =
      run_program({"run", scene, "--fast", "--probe", "replay:" + trace, "--json"});
  EXPECT_GT(nlohmann::json::parse(requested.out)["probes"][0]["released_ticks"], 900);
}

TEST(Devices, ProbesListsTheProtocols) {
  const auto text = run_program({"probes"});
  EXPECT_EQ(text.exit_code, 0);
  const auto json = run_program({"probes", "--json"});
  EXPECT_EQ(json.exit_code, 0);
  const auto list = nlohmann::json::parse(json.out);
  EXPECT_TRUE(list["devices"].is_array());
  for (const ProtocolEntry& entry : protocol_table()) {
    EXPECT_NE(text.out.find(std::string(entry.name) + " "), std::string::npos);
  }
  EXPECT_EQ(list["protocols"].size(), protocol_table().size());
}

TEST(Devices, ASetUpThatWaitsForADeviceSaysSo) {
  const LinePrinter silent("0.3", 115200, {.silence = std::chrono::seconds{9}});
  const auto run =
      run_program({"run", "--probe",
                   "serial:" + silent.name() + "?protocol=csv&columns=force_N&timeout_ms=3500"});
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_NE(run.err.find("a device may not have sent a reading yet"), std::string::npos) << run.err;
  EXPECT_NE(run.err.find("has sent nothing for 3.5 s"), std::string::npos) << run.err;
}

TEST(Devices, AFieldThatIsEmptyFromTheStartIsNamed) {
  const LinePrinter hand("0.5,,0.25");
  const TemporaryFolder folder;
  const std::string uri = "serial:" + hand.name() + "?protocol=csv&columns=thumb_N,index_N,palm_N";
  const auto scene_of = [&](const std::string& probes) {
    return folder.file("hand.toml", "preset = \"hand\"\n[[device]]\nname = \"hand\"\nuri = \"" +
                                        uri + "\"\n" + probes);
  };
  const auto probe_of = [](const std::string& patch) {
    return "[[probe]]\npatch = \"" + patch + "\"\ndevice = \"hand\"\nforce = \"" + patch + "_N\"\n";
  };
  for (const std::string& probes : {probe_of("thumb") + probe_of("index"), probe_of("index")}) {
    const auto run = run_program({"run", scene_of(probes), "--duration-s", "1"});
    EXPECT_EQ(run.exit_code, 3) << run.err;
    for (const char* words : {"#force=index_N", "\"0.5,,0.25\"", "check its sensor"}) {
      EXPECT_NE(run.err.find(words), std::string::npos) << run.err;
    }
  }
}

}  // namespace
}  // namespace merkel
