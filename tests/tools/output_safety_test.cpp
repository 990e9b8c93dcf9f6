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
  ASSERT_TRUE(wait_for_bytes(folder.path("p.journal.xdf.part"), 200));
  const auto second = run_program({"run", "--fast", "--sink", phy, "--overwrite"});
  EXPECT_EQ(second.exit_code, 2);
  EXPECT_TRUE(has(second.err, "or merkel process")) << second.err;
  first.send(SIGTERM);
  EXPECT_EQ(first.finish().exit_code, 0);
  EXPECT_TRUE(std::filesystem::exists(folder.path("p/spike_times.npy")));
}

/// Two files of one journal are made at the end: with --overwrite, the second replaced the first.
TEST(OutputSafety, TwoSinksDoNotWriteOneFile) {
  const TemporaryFolder folder;
  const std::string session = folder.path("s.xdf");
  ASSERT_EQ(run_program({"run", "--fast", "--sink", "xdf:" + session}).exit_code, 0);
  const std::string nwb = "nwb:" + folder.path("a");
  const std::vector<std::vector<std::string>> commands = {
      {"run", "--fast", "--sink", "xdf:" + folder.path("r.xdf")},
      {"export", session},
      {"replay", session},
      {"replay", session, "--realtime"}};
  for (const auto& command : commands) {
    for (const std::string& other : {"csv:" + folder.path("a"), "sonata:" + folder.path("./a")}) {
      std::vector<std::string> arguments = command;
      arguments.insert(arguments.end(), {"--sink", nwb, "--sink", other, "--overwrite"});
      const ProgramRun run = run_program(arguments);
      EXPECT_EQ(run.exit_code, 2) << run.err;
      EXPECT_TRUE(has(run.err, "write the same file")) << run.err;
      EXPECT_FALSE(std::filesystem::exists(folder.path("a")));
    }
  }
  const ProgramRun devices =
      run_program({"run", "--fast", "--sink", "csv:/dev/null", "--sink", "gdf:/dev/null"});
  EXPECT_EQ(devices.exit_code, 0) << devices.err;
}

TEST(OutputSafety, DatedNamesNeverCollideAndAKilledRunIsFinishedByTheNext) {
  const TemporaryFolder folder;
  const std::string sink = "xdf:" + folder.path("session-%t.xdf");
  StartedProgram program({"run", "--probe", kLong, "--sink", sink});
  std::vector<std::string> parts;
  for (int i = 0; i < 3000 && parts.empty(); ++i) {
    std::this_thread::sleep_for(milliseconds{10});
    parts = files_like(folder, ".xdf.part");
  }
  ASSERT_EQ(parts.size(), 1U);
  ASSERT_TRUE(wait_for_bytes(parts[0], 200'000));  // ticks, after its headers
  program.send(SIGKILL);
  program.finish();
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
  for (const bool end_now : {false, true}) {
    const TemporaryFolder folder;
    const StuckPipe pipe(folder.path("pipe"));
    const std::string spikes = folder.path("s.csv");
    StartedProgram program({"run", "--probe", kLong, "--sink", "csv:" + folder.path("pipe"),
                            "--sink", "csv:" + spikes});
    ASSERT_TRUE(wait_for_bytes(spikes + ".part", 100));
    const auto started = steady_clock::now();
    program.send(SIGHUP);
    if (end_now) {
      std::this_thread::sleep_for(milliseconds{300});
      program.send(SIGINT);
    }
    const ProgramRun ended = program.finish();
    EXPECT_EQ(ended.ended_by, 0);
    EXPECT_EQ(ended.exit_code, 1) << ended.err;
    EXPECT_LT(steady_clock::now() - started, std::chrono::seconds{end_now ? 4 : 12});
    EXPECT_TRUE(has(ended.err, "stopped reading")) << ended.err;
    EXPECT_TRUE(std::filesystem::exists(spikes));
    EXPECT_FALSE(std::filesystem::exists(spikes + ".part"));
  }
}

TEST(OutputSafety, NoOutputReplacesAFileThatItsCommandReads) {
  const TemporaryFolder folder;
  const std::string shape = folder.file("shape.csv", "0,1\n1,2\n");
  const std::string scene =
      folder.file("k.toml", "[probe]\ntip = \"shape\"\nshape = \"shape.csv\"\npixel_mm = 0.2\n");
  const std::string trace = folder.file(
      "t.csv",
      "time_s,depth_mm,force_N\n0,0,0\n0.1,0.2,0.01\n0.2,0.4,0.04\n0.3,0.6,0.1\n0.4,0.8,"
      "0.2\n0.5,1,0.3\n");
  const std::string session = folder.path("s.xdf");
  ASSERT_EQ(
      run_program({"run", "--fast", "--duration-s", "0.1", "--sink", "xdf:" + session}).exit_code,
      0);
  const auto kept = [&](const std::string& file, const std::vector<std::string>& arguments) {
    const std::string before = read_file(file);
    const ProgramRun run = run_program(arguments);
    EXPECT_EQ(run.exit_code, 2) << arguments[0] << run.err;
    EXPECT_TRUE(has(run.err, "would destroy its input")) << arguments[0] << run.err;
    EXPECT_EQ(read_file(file), before) << arguments[0];
  };
  for (const char* const scheme : {"csv:", "gdf:", "trace:", "xdf:", "nwb:", "sonata:"}) {
    for (const std::string& file : {scene, shape}) {
      kept(file, {"run", scene, "--fast", "--sink", scheme + file, "--overwrite"});
    }
  }
  kept(shape,
       {"fit", "skin", scene, "--trace", trace, "--radius-mm", "2", "--out", shape, "--overwrite"});
  kept(trace, {"record", "replay:" + trace, trace, "--overwrite"});
  kept(session, {"replay", session, "--sink", "csv:" + session, "--overwrite"});
  kept(session, {"export", session, "--sink", "csv:" + session, "--overwrite"});
  kept(session, {"merge", session, session, "--sink", "csv:" + session, "--overwrite"});
  const std::string jobs = folder.file("results.csv", "seed,duration_s\n1,0.1\n");
  kept(jobs, {"batch", jobs, "--out", folder.path("")});
}

TEST(OutputSafety, ABatchReplacesNoFileThatItHasNotWritten) {
  const TemporaryFolder folder;
  const std::string jobs = folder.file("jobs.csv", "name,seed,duration_s\na,1,0.1\n,2,0.1\n");
  const std::string table = folder.file("results.csv", "mine");
  auto run = run_program({"batch", jobs, "--out", folder.path("")});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_TRUE(has(run.err, "no batch has written it")) << run.err;
  EXPECT_EQ(read_file(table), "mine");
  const std::string out = folder.path("out");
  std::filesystem::create_directories(out);
  static_cast<void>(folder.file("out/a.csv", "mine"));
  run = run_program({"batch", jobs, "--out", out, "--keep", "csv"});
  EXPECT_TRUE(has(run.err, "no batch has written it")) << run.err;
  EXPECT_EQ(read_file(out + "/a.csv"), "mine");
}

TEST(OutputSafety, ABatchNamesItsFilesAsItsJobs) {
  const TemporaryFolder folder;
  const std::string out = folder.path("out");
  const auto batch = [&](const std::string& jobs) {
    return run_program({"batch", folder.file("jobs.csv", jobs), "--out", out, "--keep", "csv"});
  };
  const std::string first = "name,seed\nslow press,1\n,2\n";
  ASSERT_EQ(batch(first).exit_code, 0);
  const std::string spikes = read_file(out + "/slow press.csv");
  EXPECT_TRUE(has(spikes, "time_s,neuron"));
  EXPECT_TRUE(has(read_file(out + "/results.csv"), ",slow press.csv,"));
  // Another job of this name replaces the file, so that the first one runs again.
  ASSERT_EQ(batch("name,seed\nslow press,7\n").exit_code, 0);
  EXPECT_NE(read_file(out + "/slow press.csv"), spikes);
  ASSERT_EQ(batch(first).exit_code, 0);
  EXPECT_EQ(read_file(out + "/slow press.csv"), spikes);
  EXPECT_TRUE(has(batch("name,seed\na,1\na,2\n").err, "give them different names"));
  EXPECT_TRUE(has(batch("seed,seed\n1,2\n").err, "two columns \"seed\""));
  for (const char* const name : {"../a", "results", ".a", "a?b", "a%t"}) {
    const auto run = batch("name,seed\n" + std::string(name) + ",1\n");
    EXPECT_EQ(run.exit_code, 2) << name;
    EXPECT_TRUE(has(run.err, "cannot be that of its kept file")) << run.err;
  }
}

TEST(OutputSafety, TheSummaryIsNotAmongTheDataOfStandardOutput) {
  const TemporaryFolder folder;
  const std::string session = folder.path("s.xdf");
  ASSERT_EQ(run_program({"run", "--fast", "--sink", "xdf:" + session}).exit_code, 0);
  for (const char* const sink :
       {"csv:-", "csv:-?time=device", "csv:/dev/stdout?time=unix", "gdf:-?time=device", "trace:-",
        "csv:/proc/self/fd/1?time=device"}) {
    std::vector<std::vector<std::string>> commands = {{"run", "--fast", "--sink", sink}};
    if (!has(sink, "trace")) commands.push_back({"replay", session, "--sink", sink});
    for (const auto& command : commands) {
      const std::string line = std::string(MERKEL_PROGRAM) + " " + command[0] + " " + command[1] +
                               " " + (command.size() > 3 ? command[2] + " '" + command[3] : "'") +
                               "' 2>" + folder.path("err") + " | tail -n 1 >" + folder.path("out");
      ASSERT_EQ(std::system(line.c_str()), 0) << line;
      const std::string last = read_file(folder.path("out"));
      EXPECT_TRUE(!last.empty() && last.find_first_not_of("0123456789.,\t-\n") == last.npos)
          << line << "\n"
          << last;
      EXPECT_FALSE(read_file(folder.path("err")).empty()) << line;
    }
  }
}

TEST(OutputSafety, WhatIsNoFileIsRefusedInASentence) {
  const TemporaryFolder folder;
  const auto refused = [](const std::vector<std::string>& arguments, const std::string& words) {
    const ProgramRun run = run_program(arguments);
    EXPECT_EQ(run.exit_code, 2) << run.err;
    EXPECT_TRUE(has(run.err, words)) << run.err;
    EXPECT_LT(run.peak_memory_MiB, 700.0) << words;
  };
  refused({"batch", folder.path(""), "--out", folder.path("o")}, "holds no session (*.xdf)");
  refused({"batch", "/dev/zero", "--out", folder.path("o")}, "it is larger than");
  refused({"run", "/dev/zero"}, "it is larger than 1 MiB");
  refused({"run", folder.path("")}, "it is a directory");
  for (const auto& [shape, words] : {std::pair("/proc/self/mem", "is it a regular file?"),
                                     std::pair("/dev/zero", "it is not a file")}) {
    refused(
        {"run", "--fast",
         folder.file("k.toml", std::string("[probe]\ntip = \"shape\"\npixel_mm = 1\nshape = \"") +
                                   shape + "\"\n")},
        words);
  }
}

}  // namespace
}  // namespace merkel
