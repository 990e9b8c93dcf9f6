// The effect of runs on files: other files are kept, and their own data is not lost.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>
#include <unistd.h>

#include "tests/temporary_folder.hpp"
#include "tests/text_has.hpp"
#include "tests/tools/program.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

const char* const kLong = "sim:ramp?wait_s=0&hold_s=600&live=1";

/// Waits until a file has this number of bytes.
bool wait_for_bytes(const std::string& path, std::uintmax_t bytes) {
  for (int i = 0; i < 3000; ++i) {
    std::error_code none;
    const auto size = std::filesystem::file_size(path, none);
    if (!none && size >= bytes) return true;
    std::this_thread::sleep_for(milliseconds{10});
  }
  return false;
}

std::vector<std::string> files_like(const TemporaryFolder& folder, const std::string& part) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path(""))) {
    if (has(entry.path().filename().string(), part)) names.push_back(entry.path().string());
  }
  return names;
}

TEST(OutputSafety, ARecordedTraceSurvivesAKillUpToItsLast200Ms) {
  const TemporaryFolder folder;
  for (const bool run : {false, true}) {
    const std::string trace = folder.path(run ? "run.csv" : "record.csv");
    StartedProgram program(
        run ? std::vector<std::string>{"run", "--probe", kLong, "--record", trace}
            : std::vector<std::string>{"record", kLong, trace});
    ASSERT_TRUE(wait_for_bytes(trace + ".part", 2000)) << run;
    std::this_thread::sleep_for(milliseconds{1000});
    program.send(SIGKILL);
    program.finish();
    const std::string rows = read_file(trace + ".part");
    EXPECT_EQ(rows.back(), '\n');
    // More than a second at 1 kHz minus 200 ms, with a margin for a busy machine.
    EXPECT_GT(std::count(rows.begin(), rows.end(), '\n'), 800) << run;
    const auto replay =
        run_program({"run", "--fast", "--probe", "replay:" + trace + ".part", "--json"});
    EXPECT_EQ(replay.exit_code, 0) << replay.err;
  }
}

TEST(OutputSafety, AFullDiskUnderARecordingDoesNotEndTheRun) {
  const TemporaryFolder folder;
  const auto run =
      run_program({"run", "--fast", "--probe", "replay:tests/traces/taps.csv", "--record",
                   "/dev/full", "--sink", "csv:" + folder.path("s.csv"), "--json"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_TRUE(has(run.err, "No space left")) << run.err;
  const auto summary = nlohmann::json::parse(run.out);
  EXPECT_EQ(summary["sinks"][0]["delivered"], summary["spikes"]);
  EXPECT_GT(summary["spikes"].get<int>(), 20);
}

TEST(OutputSafety, AnAddressDoesNotDestroyTheFileOfItsName) {
  const TemporaryFolder folder;
  const std::string file = folder.file("important.csv", "precious");
  const auto run = run_program({"run", "--fast", "--sink", "zmq:ipc://" + file});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_TRUE(has(run.err, "is not a socket")) << run.err;
  EXPECT_EQ(read_file(file), "precious");
}

TEST(OutputSafety, ALinkDoesNotReplaceAFile) {
  const TemporaryFolder folder;
  const std::string file = folder.file("keep.txt", "precious");
  const auto run = run_program({"simulate-probe", "hbf1", "--trace", "tests/traces/taps.csv",
                                "--link", file, "--duration-s", "0.1"});
  EXPECT_EQ(run.exit_code, 2) << run.err;
  EXPECT_EQ(read_file(file), "precious");
}

TEST(OutputSafety, AFileThatAppearsDuringARunIsKept) {
  const TemporaryFolder folder;
  const std::string file = folder.path("s.csv");
  StartedProgram program({"run", "--probe", kLong, "--sink", "csv:" + file});
  ASSERT_TRUE(wait_for_bytes(file + ".part", 100));
  static_cast<void>(folder.file("s.csv", "precious"));
  program.send(SIGTERM);
  const ProgramRun ended = program.finish();
  EXPECT_EQ(ended.exit_code, 1);
  EXPECT_TRUE(has(ended.err, "s.csv.part")) << ended.err;
  EXPECT_EQ(read_file(file), "precious");
  EXPECT_GT(std::filesystem::file_size(file + ".part"), 100U);
}

TEST(OutputSafety, WithClosedStandardStreamsNothingOfTheirsLandsInAFile) {
  const TemporaryFolder folder;
  const std::string file = folder.path("s.csv");
  const std::string command =
      std::string(MERKEL_PROGRAM) +
      " run --fast --probe replay:tests/traces/taps.csv --sink csv:" + file +
      " --sink csv:/dev/full <&- >&- 2>&-";
  EXPECT_NE(std::system(command.c_str()), 0);  // NOLINT(cert-env33-c): of this test's own words
  const std::string spikes = read_file(file);
  EXPECT_TRUE(spikes.starts_with("time_s,neuron\n")) << spikes.substr(0, 200);
  EXPECT_EQ(spikes.find_first_not_of("0123456789.,\n", 14), std::string::npos);
  // Writing spikes to a closed standard output is an error.
  const std::string lost = std::string(MERKEL_PROGRAM) + " run --fast --sink csv:- >&- 2>/dev/null";
  EXPECT_NE(std::system(lost.c_str()), 0);  // NOLINT(cert-env33-c)
}

TEST(OutputSafety, AFolderOfPhyHasOneWriter) {
  const TemporaryFolder folder;
  const std::string phy = "phy:" + folder.path("p");
  StartedProgram first({"run", "--probe", kLong, "--sink", phy});
  ASSERT_TRUE(wait_for_bytes(folder.path("p/spike_times.npy.part"), 200));
  const auto second = run_program({"run", "--fast", "--sink", phy, "--overwrite"});
  EXPECT_EQ(second.exit_code, 2);
  EXPECT_TRUE(has(second.err, "or merkel process")) << second.err;
  first.send(SIGTERM);
  EXPECT_EQ(first.finish().exit_code, 0);
  EXPECT_TRUE(std::filesystem::exists(folder.path("p/spike_times.npy")));
}

TEST(OutputSafety, DatedNamesNeverCollideAndAKilledRunIsFinishedByTheNext) {
  const TemporaryFolder folder;
  const std::string sink = "xdf:" + folder.path("session-%t.xdf");
  StartedProgram program({"run", "--probe", kLong, "--sink", sink});
  std::this_thread::sleep_for(milliseconds{1500});
  program.send(SIGKILL);
  program.finish();
  ASSERT_EQ(files_like(folder, ".xdf.part").size(), 1U);
  const auto next = run_program({"run", "--fast", "--sink", sink});
  EXPECT_EQ(next.exit_code, 0) << next.err;
  EXPECT_TRUE(has(next.err, "a killed run left")) << next.err;
  EXPECT_TRUE(files_like(folder, ".part").empty());
  const auto sessions = files_like(folder, "session-2");
  ASSERT_EQ(sessions.size(), 2U);
  for (const std::string& session : sessions) {
    const auto replay = run_program({"replay", session});
    EXPECT_EQ(replay.exit_code, 0) << replay.out << replay.err;
  }
}

/// A full pipe without a reader.
class StuckPipe {
 public:
  explicit StuckPipe(const std::string& path) {
    EXPECT_EQ(::mkfifo(path.c_str(), 0600), 0);
    reader_ = ::open(path.c_str(), O_RDWR | O_NONBLOCK);
    const std::string full(4096, ' ');
    while (::write(reader_, full.data(), full.size()) > 0) {
    }
  }
  StuckPipe(const StuckPipe&) = delete;
  StuckPipe& operator=(const StuckPipe&) = delete;
  ~StuckPipe() { ::close(reader_); }

 private:
  int reader_ = -1;
};

TEST(OutputSafety, AnUnreadPipeDoesNotKeepTheProgramOrOtherSinksFromEnding) {
  for (const bool hurry : {false, true}) {
    const TemporaryFolder folder;
    const StuckPipe pipe(folder.path("pipe"));
    const std::string spikes = folder.path("s.csv");
    StartedProgram program({"run", "--probe", kLong, "--sink", "csv:" + folder.path("pipe"),
                            "--sink", "csv:" + spikes});
    ASSERT_TRUE(wait_for_bytes(spikes + ".part", 100));
    const auto started = steady_clock::now();
    program.send(SIGHUP);
    if (hurry) {
      std::this_thread::sleep_for(milliseconds{300});
      program.send(SIGINT);
    }
    const ProgramRun ended = program.finish();
    EXPECT_EQ(ended.ended_by, 0);
    EXPECT_EQ(ended.exit_code, 1) << ended.err;
    EXPECT_LT(steady_clock::now() - started, std::chrono::seconds{hurry ? 4 : 12});
    EXPECT_TRUE(has(ended.err, "stopped reading")) << ended.err;
    EXPECT_TRUE(std::filesystem::exists(spikes));
    EXPECT_FALSE(std::filesystem::exists(spikes + ".part"));
  }
}

}  // namespace
}  // namespace merkel
