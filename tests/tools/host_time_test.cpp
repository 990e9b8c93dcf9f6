#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/temporary_folder.hpp"
#include "tests/tools/program.hpp"

namespace merkel {
namespace {

const std::string kTaps = "sim:taps?count=2&interval_s=0.2&tail_s=0.1";

nlohmann::json summary_of(const std::string& loop, const std::string& probe) {
  const TemporaryFolder folder;
  const auto run = run_program(
      {"run", folder.file("scene.toml", "[loop]\n" + loop), "--probe", probe, "--json"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  return run.exit_code == 0 ? nlohmann::json::parse(run.out) : nlohmann::json{};
}

TEST(HostTime, ALiveRunReportsItsRealTimePerformance) {
  const auto summary = summary_of("[probe]\ndelay_ms = 2\n", kTaps + "&live=1");
  const auto& loop = summary["loop"];
  EXPECT_EQ(loop["wait"], "hybrid");
  EXPECT_GT(loop["margin_us"].get<double>(), 0.0);
  for (const char* stage : {"queue", "tick", "publish"}) {
    // Ticks with a held sample are not in the queue's statistics.
    const auto ticks = summary["ticks"].get<std::uint64_t>();
    EXPECT_GE(loop[stage]["count"].get<std::uint64_t>(),
              stage == std::string("queue") ? ticks / 2 : ticks);
    EXPECT_LE(loop[stage]["p50_us"], loop[stage]["p99_us"]);
    EXPECT_LE(loop[stage]["p99_us"], loop[stage]["max_us"]);
  }
  // A missing right must match the reported scheduler, memory lock or latency, and vice versa.
  const std::size_t refused = (loop["scheduler"] == "fifo" ? 0U : 1U) +
                              (loop["memory_locked"].get<bool>() ? 0U : 1U) +
                              (loop["cpu_awake"].get<bool>() ? 0U : 1U);
  EXPECT_EQ(loop["missing_rights"].size(), refused);
  EXPECT_EQ(summary["overruns"].get<int>(), summary["overruns_by_late_wake_up"].get<int>() +
                                                summary["overruns_by_long_compute"].get<int>());
  const auto& probe = summary["probes"][0];
  EXPECT_EQ(probe["samples_in"].get<int>(), probe["used"].get<int>() + probe["late"].get<int>() +
                                                probe["dropped"].get<int>() +
                                                probe["unused"].get<int>());
}

TEST(HostTime, TheSceneChoosesHowTheLoopRuns) {
  const auto summary = summary_of(
      "wait = \"sleep\"\nscheduler = \"normal\"\nlock_memory = false\ncpu_awake = false\n", kTaps);
  const auto& loop = summary["loop"];
  EXPECT_EQ(loop["wait"], "sleep");
  EXPECT_TRUE(loop["margin_us"].is_null());
  EXPECT_EQ(loop["scheduler"], "normal");
  EXPECT_FALSE(loop["memory_locked"].get<bool>());
  EXPECT_TRUE(loop["missing_rights"].empty());
  EXPECT_TRUE(loop["queue"].is_null());  // a recording's samples do not arrive
}

TEST(HostTime, AFastRunHasNone) {
  const auto run = run_program({"run", "--fast", "--json", "--probe", kTaps});
  EXPECT_TRUE(nlohmann::json::parse(run.out)["loop"].is_null());
}

TEST(HostTime, WrongLoopKeysAreRefused) {
  const TemporaryFolder folder;
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"threads = 4000", "loop.threads = 4000 must be from 1 to "},
      {"threads = 0", "loop.threads = 0"},
      {"priority = 99", "loop.priority"},
      {"cpu = -1", "loop.cpu"},
      {"wait = \"spin\"", "one of \"hybrid\", \"sleep\""},
      {"lock_memory = 1", "lock_memory"},
      {"shceduler = \"fifo\"", "did you mean"}};
  for (const auto& [key, sentence] : cases) {
    const auto run =
        run_program({"run", "--fast", folder.file("scene.toml", "[loop]\n" + key + "\n")});
    EXPECT_EQ(run.exit_code, 2) << key;
    EXPECT_NE(run.err.find(sentence), std::string::npos) << run.err;
  }
}

}  // namespace
}  // namespace merkel
