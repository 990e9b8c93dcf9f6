#include <chrono>
#include <csignal>
#include <filesystem>
#include <sstream>
#include <thread>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/temporary_folder.hpp"
#include "tests/tools/program.hpp"

namespace merkel {
namespace {

/// A run of ten minutes with spikes from the start, which the test ends early.
struct LongRun {
  explicit LongRun(const std::vector<std::string>& more = {})
      : program([&] {
          std::vector<std::string> arguments = {
              "run", "--probe", "sim:ramp?wait_s=0&hold_s=600&live=1", "--sink", "csv:" + spikes};
          arguments.insert(arguments.end(), more.begin(), more.end());
          return arguments;
        }()) {}

  /// Waits until spikes have been flushed.
  void wait_for_spikes() const {
    const std::string part = spikes + ".part";
    for (int i = 0; i < 2000; ++i) {
      std::error_code none;
      const auto size = std::filesystem::file_size(part, none);
      if (!none && size > 100) return;
      std::this_thread::sleep_for(std::chrono::milliseconds{10});
    }
    FAIL() << "no spikes came";
  }

  TemporaryFolder folder;
  std::string spikes = folder.path("s.csv");
  StartedProgram program;
};

/// Rows of a spike file; checks that each is complete.
int whole_rows(const std::string& text) {
  std::istringstream lines(text);
  std::string line;
  while (std::getline(lines, line) && line.starts_with('#')) {
  }
  EXPECT_EQ(line, "time_s,neuron");
  EXPECT_EQ(text.back(), '\n');
  int rows = 0;
  for (; std::getline(lines, line); ++rows) {
    const auto comma = line.find(',');
    EXPECT_NE(comma, std::string::npos) << line;
    EXPECT_GE(line.size() - comma, 2U) << line;
  }
  return rows;
}

TEST(Ending, AnInterruptEndsTheRunWithItsSinksFlushedAndItsSummaryWhole) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    LongRun run({"--json"});
    run.wait_for_spikes();
    run.program.send(signal);
    const ProgramRun ended = run.program.finish();
    EXPECT_EQ(ended.exit_code, 0) << ended.err;
    const auto summary = nlohmann::json::parse(ended.out);
    EXPECT_TRUE(summary["interrupted"].get<bool>());
    EXPECT_EQ(whole_rows(read_file(run.spikes)), summary["spikes"].get<int>());
    EXPECT_EQ(summary["sinks"][0]["delivered"], summary["spikes"]);
    EXPECT_FALSE(std::filesystem::exists(run.spikes + ".part"));
  }
}

TEST(Ending, AKilledRunLeavesWholeRowsInThePartFile) {
  LongRun run;
  run.wait_for_spikes();
  run.program.send(SIGKILL);
  EXPECT_EQ(run.program.finish().ended_by, SIGKILL);
  EXPECT_FALSE(std::filesystem::exists(run.spikes));
  EXPECT_GT(whole_rows(read_file(run.spikes + ".part")), 0);
}

#ifndef MERKEL_SANITIZED  // a sanitizer reports crashes itself
TEST(Ending, ACrashReportsTheBuildAndTheProgressOfTheRun) {
  LongRun run;
  run.wait_for_spikes();
  run.program.send(SIGSEGV);
  const ProgramRun ended = run.program.finish();
  EXPECT_EQ(ended.ended_by, SIGSEGV);
  EXPECT_NE(ended.err.find("SIGSEGV"), std::string::npos) << ended.err;
  const auto id = ended.err.find("build id ");
  ASSERT_NE(id, std::string::npos) << ended.err;
  EXPECT_EQ(ended.err.find_first_not_of("0123456789abcdef", id + 9), id + 9 + 40) << ended.err;
  EXPECT_NE(ended.err.find("had reached tick "), std::string::npos) << ended.err;
  EXPECT_GT(whole_rows(read_file(run.spikes + ".part")), 0);
}
#endif

}  // namespace
}  // namespace merkel
