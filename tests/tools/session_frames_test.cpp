#include <algorithm>
#include <sstream>

#include <gtest/gtest.h>

#include "drivers/sessions/session_reader.hpp"
#include "tests/drivers/simulation/parse_again.hpp"
#include "tests/drivers/simulation/running_device.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/program.hpp"

namespace merkel {
namespace {

struct Recorded {
  std::vector<ProbeSample> samples;
  std::vector<std::vector<RawFrame>> frames;  ///< by port
  RunStatus status;                           ///< the last one
};

Recorded read_session(const std::string& path) {
  Recorded recorded;
  auto session = SessionReader::open(path);
  EXPECT_TRUE(session) << session.error().sentence;
  if (!session) return recorded;
  SessionChunk chunk;
  for (auto more = session->next(chunk); more && *more; more = session->next(chunk)) {
    for (const auto& each : chunk.samples) recorded.samples.push_back(each.sample);
    for (const auto& each : chunk.frames) {
      EXPECT_EQ(each.probe, 0U);
      recorded.frames.resize(std::max<std::size_t>(recorded.frames.size(), each.port + 1));
      recorded.frames[each.port].push_back(each.frame);
    }
    if (!chunk.status.empty()) recorded.status = chunk.status.back();
  }
  return recorded;
}

/// The readings of the host's clocks.
std::vector<std::pair<std::chrono::nanoseconds, std::chrono::nanoseconds>> clocks_of(
    const std::string& path) {
  std::vector<std::pair<std::chrono::nanoseconds, std::chrono::nanoseconds>> clocks;
  auto session = SessionReader::open(path);
  EXPECT_TRUE(session && session->for_each([](const SessionChunk&) {}));
  if (!session) return clocks;
  for (const ClockReading& each : session->clock_readings())
    clocks.emplace_back(each.from, each.to);
  return clocks;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

TEST(SessionFrames, TheBytesOfARunParseAgainToItsSamples) {
  const TemporaryFolder folder;
  RunningDevice device("hbf1", {.drop_byte = 0.001, .flip_byte = 0.001});
  const std::string path = folder.path("s.xdf");
  const auto run = run_program({"run", "--probe", device.uri(), "--duration-s", "0.7", "--sink",
                                "xdf:" + path + "?frames=1"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const Recorded recorded = read_session(path);
  ASSERT_EQ(recorded.frames.size(), 1U);
  EXPECT_EQ(recorded.status.losses.frames, 0U);
  const auto again = parse_again(device.uri(), recorded.frames[0]);
  EXPECT_GT(recorded.samples.size(), 300U);
  expect_same_samples(recorded.samples, again.samples);
  EXPECT_EQ(again.counts.frames, again.recorded.frames);
  EXPECT_EQ(again.counts.damaged, again.recorded.damaged);
  EXPECT_EQ(again.counts.lost, again.recorded.lost);
  EXPECT_EQ(run_program({"replay", path}).exit_code, 0);

  const auto shown = run_program({"inspect", "session", path, "--stream", "frames"});
  const auto rows = lines_of(shown.out);
  ASSERT_EQ(rows.size(), recorded.frames[0].size() + 1);
  EXPECT_EQ(rows[0], "probe,port,time_s,kind,length,parsed,damaged,lost,bytes");
  EXPECT_NE(rows[1].find(",opened,0,0,0,0,"), std::string::npos) << rows[1];
  const auto overview = run_program({"inspect", "session", path});
  EXPECT_NE(overview.out.find("stream frames," + std::to_string(rows.size() - 1) + "\n"),
            std::string::npos)
      << overview.out;

  // An exported copy also has them.
  const std::string copy = folder.path("copy.xdf");
  ASSERT_EQ(run_program({"export", path, "--sink", "xdf:" + copy + "?frames=1"}).exit_code, 0);
  EXPECT_EQ(read_session(copy).frames, recorded.frames);
  EXPECT_FALSE(clocks_of(path).empty());
  EXPECT_EQ(clocks_of(copy), clocks_of(path));
  for (const char* fact : {"clock_utc_ns", "probe_serial_number", "scene", "kernel"}) {
    EXPECT_EQ(run_program({"inspect", "session", copy, "--fact", fact}).out,
              run_program({"inspect", "session", path, "--fact", fact}).out);
  }
}

// tests/golden/formats_test.py describes the file.
TEST(SessionFrames, TheBytesThatADeviceSentToAnEarlierVersionParseToItsSamples) {
  const Recorded recorded = read_session("tests/golden/0.1.0/frames.xdf");
  ASSERT_EQ(recorded.frames.size(), 1U);
  const auto again = parse_again("serial:device?protocol=hbf1", recorded.frames[0]);
  EXPECT_GT(recorded.samples.size(), 90U);
  expect_same_samples(recorded.samples, again.samples);
  EXPECT_EQ(again.counts.damaged, 0U);
  EXPECT_EQ(again.counts.lost, 0U);
}

TEST(SessionFrames, RecordKeepsThemWithoutASimulation) {
  const TemporaryFolder folder;
  RunningDevice force("mark10", {});
  RunningDevice depth("csv", {});
  const std::string path = folder.path("r.xdf");
  const std::string fused = "fused:" + force.uri() + "|" + depth.uri();
  const auto run = run_program({"record", fused, path, "--duration-s", "0.4", "--frames"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const Recorded recorded = read_session(path);
  ASSERT_EQ(recorded.frames.size(), 2U);
  const auto forces = parse_again(force.uri(), recorded.frames[0]);
  const auto depths = parse_again(depth.uri(), recorded.frames[1]);
  EXPECT_GE(forces.samples.size(), recorded.samples.size());
  EXPECT_GE(depths.samples.size(), 100U);
  EXPECT_EQ(recorded.status.losses.frames, 0U);
}

TEST(SessionFrames, ASessionHasThemOnRequestOnly) {
  const TemporaryFolder folder;
  RunningDevice device("hbf1", {});
  const std::string session = folder.path("d.xdf");
  const auto run = run_program(
      {"run", "--probe", device.uri(), "--duration-s", "0.3", "--sink", "xdf:" + session});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_GT(read_session(session).samples.size(), 100U);
  EXPECT_TRUE(read_session(session).frames.empty());
  const auto trace = run_program({"record", device.uri(), folder.path("t.csv"), "--frames"});
  EXPECT_EQ(trace.exit_code, 2);
  EXPECT_NE(trace.err.find("give " + folder.path("t.csv") + " the ending .xdf"), std::string::npos)
      << trace.err;
}

TEST(SessionFrames, ARecordingHasNone) {
  const TemporaryFolder folder;
  const std::string path = folder.path("s.xdf");
  ASSERT_EQ(run_program({"run", "--fast", "--sink", "xdf:" + path}).exit_code, 0);
  EXPECT_TRUE(read_session(path).frames.empty());
}

TEST(InspectSession, RefusesWhatItDoesNotKnow) {
  const TemporaryFolder folder;
  const std::string path = folder.path("s.xdf");
  ASSERT_EQ(
      run_program({"run", "goodwin", "--fast", "--duration-s", "0.1", "--sink", "xdf:" + path})
          .exit_code,
      0);
  const auto stream = run_program({"inspect", "session", path, "--stream", "spike"});
  EXPECT_EQ(stream.exit_code, 2);
  EXPECT_NE(stream.err.find("is not one of spikes, ticks"), std::string::npos) << stream.err;
  EXPECT_EQ(run_program({"inspect", "session", path, "--fact", "no"}).exit_code, 2);
  EXPECT_EQ(run_program({"inspect", "session", folder.path("none")}).exit_code, 2);
  EXPECT_EQ(run_program({"inspect", "session", path, "--fact", "scene"}).out, "goodwin\n");
  const auto overview = run_program({"inspect", "session", path}).out;
  EXPECT_NE(overview.find("stream stimulation,0\nstream marks,0\n"), std::string::npos) << overview;
  EXPECT_EQ(run_program({"inspect", "session", path, "--stream", "marks"}).out, "time_s,label\n");
  EXPECT_EQ(run_program({"inspect", "session", path, "--stream", "stimulation"}).out,
            "time_s,electrode,kind,amplitude_uA,frequency_Hz,heartbeat,stop\n");
  EXPECT_EQ(run_program({"inspect", "session", path, "--stream", "delay"}).out,
            "time_s,delay_s\n0.001000000,0.000000000\n");  // it never changes
  const auto rows = lines_of(run_program({"inspect", "session", path, "--stream", "ticks"}).out);
  EXPECT_EQ(rows.size(), 101U);
  EXPECT_EQ(
      rows[0],
      "number,probe,time_s,latency_s,depth_mm,force_mN,x_mm,y_mm,late,state,delay_s,taxel_blocks,doubts,"
      "touch");
  EXPECT_EQ(rows[1], "1,0,0.001000000,0.000000000,0,0,15,10,0,following,0.000000000,0,0,free");
}

}  // namespace
}  // namespace merkel
