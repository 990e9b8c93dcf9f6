#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "drivers/sessions/session_reader.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/program.hpp"

namespace merkel {
namespace {

/// Runs the program, which must succeed. \return what it printed as errors
std::string succeed(const std::vector<std::string>& arguments) {
  const ProgramRun run = run_program(arguments);
  EXPECT_EQ(run.exit_code, 0) << run.err;
  return run.err;
}

TEST(RecordedPress, ASessionIsAProbeForAnyScene) {
  const TemporaryFolder folder;
  const std::string session = folder.path("s.xdf");
  succeed({"run", "finger", "--fast", "--probe", "replay:tests/traces/taps.csv", "--sink",
           "xdf:" + session});
  for (const char* const scene : {"finger", "paper"}) {
    const std::string of_trace = folder.path(std::string(scene) + "_trace.csv");
    const std::string of_session = folder.path(std::string(scene) + "_session.csv");
    succeed({"run", scene, "--fast", "--probe", "replay:tests/traces/taps.csv", "--sink",
             "csv:" + of_trace});
    succeed(
        {"run", scene, "--fast", "--probe", "replay:" + session, "--sink", "csv:" + of_session});
    succeed({"compare", of_trace, of_session, "--within-us", "0"});
    EXPECT_EQ(read_file(of_trace), read_file(of_session));
  }
  const ProgramRun other =
      run_program({"run", "--fast", "--probe", "replay:" + session + "?probe=1"});
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_NE(other.err.find("has no samples of probe 1"), std::string::npos) << other.err;
}

TEST(RecordedPress, ALiveSessionReplaysOnItsOwnTicks) {
  const TemporaryFolder folder;
  const std::string session = folder.path("live.xdf");
  const std::string live = folder.path("live.csv");
  succeed({"run", "finger", "--probe", "sim:ramp?depth_mm=1.5&hold_s=0.4&live=1", "--sink",
           "xdf:" + session, "--sink", "csv:" + live});
  // Where the machine was too busy to be on time, the run was another.
  auto again = SessionReader::open(session);
  ASSERT_TRUE(again);
  RunStatus last;
  for (SessionChunk chunk; again->next(chunk).value_or(false);) {
    if (!chunk.status.empty()) last = chunk.status.back();
  }
  const RunCounters& counters = last.counters;
  if (counters.held_ticks + counters.skipped_ticks + counters.samples_late > 0) {
    GTEST_SKIP() << "the machine was too busy for a run on time";
  }
  const std::string replayed = folder.path("replayed.csv");
  succeed({"run", "finger", "--fast", "--probe", "replay:" + session, "--sink", "csv:" + replayed});
  succeed({"compare", live, replayed, "--within-us", "0"});
}

TEST(RecordedPress, ColumnsThatTheModelDoesNotUseReachTheSession) {
  const TemporaryFolder folder;
  std::string rows = "time_s,depth_mm,skin_temperature_C,sequence,remark\n";
  for (int i = 0; i < 50; ++i) {
    rows += "0." + std::to_string(100 + i) + ",0.5," + std::to_string(30 + i) + ",7," +
            (i == 3   ? "oops"
             : i == 4 ? ""
                      : "1.5") +
            "\n";
  }
  const std::string trace = folder.file("t.csv", rows);
  const std::string session = folder.path("s.xdf");
  const std::string said =
      succeed({"run", "--fast", "--probe", "replay:" + trace, "--sink", "xdf:" + session});
  EXPECT_NE(said.find("t.csv: the model does not use skin_temperature_C, sequence, remark"),
            std::string::npos)
      << said;
  EXPECT_NE(said.find("t.csv:5: remark is text"), std::string::npos) << said;
  auto reader = SessionReader::open(session);
  ASSERT_TRUE(reader);
  EXPECT_EQ(reader->extra_columns(),
            (std::vector<std::string>{"skin_temperature_C", "column_sequence", "remark"}));
  EXPECT_TRUE(reader->has_validity());
  std::vector<DeliveredSample> samples;
  for (SessionChunk chunk; reader->next(chunk).value_or(false);) {
    samples.insert(samples.end(), chunk.samples.begin(), chunk.samples.end());
  }
  ASSERT_EQ(samples.size(), 50U);
  EXPECT_EQ(samples[10].further[0], 40.0);
  EXPECT_EQ(samples[10].further[1], 7.0);
  EXPECT_TRUE(std::isnan(samples[3].further[2]));
  EXPECT_TRUE(std::isnan(samples[4].further[2]));
  EXPECT_EQ(samples[5].further[2], 1.5);
  const std::string printed =
      run_program({"inspect", "session", session, "--stream", "merkel.samples"}).out;
  EXPECT_NE(printed.find("sequence,channels,valid_for_s,zero_mN,touch,skin_temperature_C,"
                         "column_sequence,remark\n"),
            std::string::npos)
      << printed;
  EXPECT_NE(printed.find(",40,7,1.5\n"), std::string::npos) << printed;
  EXPECT_NE(printed.find(",33,7,nan\n"), std::string::npos) << printed;
  // And from the session back into a trace.
  const std::string exported = folder.path("exported.csv");
  succeed({"export", session, "--sink", "trace:" + exported});
  EXPECT_NE(read_file(exported).find("time_s,depth_mm,skin_temperature_C,column_sequence,remark"),
            std::string::npos);
  EXPECT_NE(read_file(exported).find("0.110000000,0.5,40,7,1.5\n"), std::string::npos);
}

TEST(RecordedPress, AnExportHasWhatTheRunHad) {
  const TemporaryFolder folder;
  const std::string session = folder.path("s.xdf");
  const std::string during = folder.path("during.csv");
  std::string rows = "time_s,force_N,x_mm\n";
  for (int i = 0; i < 200; ++i) rows += "0." + std::to_string(100 + i) + ",0.8,14\n";
  const std::string trace = folder.file("t.csv", rows);
  succeed({"run", "finger", "--fast", "--probe", "replay:" + trace, "--sink", "xdf:" + session,
           "--sink", "csv:" + during, "--sink", "nwb:" + folder.path("during.nwb")});
  succeed({"export", session, "--sink", "csv:" + folder.path("after.csv"), "--sink",
           "nwb:" + folder.path("after.nwb"), "--sink", "trace:" + folder.path("press.csv")});
  EXPECT_EQ(read_file(during), read_file(folder.path("after.csv")));
  succeed({"compare", folder.path("during.nwb"), folder.path("after.nwb"), "--within-us", "0"});
  const std::string press = read_file(folder.path("press.csv"));
  EXPECT_NE(press.find("time_s,force_N,x_mm\n"), std::string::npos) << press.substr(0, 200);
  EXPECT_NE(press.find("0.150000000,0.8,14\n"), std::string::npos);
  // Samples that were recorded by themselves leave as a trace too.
  const std::string samples = folder.path("samples.xdf");
  succeed({"record", "replay:" + trace, samples});
  succeed({"export", samples, "--sink", "trace:" + folder.path("again.csv")});
  EXPECT_NE(read_file(folder.path("again.csv")).find("0.150000000,0.8,14\n"), std::string::npos);
}

}  // namespace
}  // namespace merkel
