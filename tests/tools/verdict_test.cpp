#include "tools/run/verdict.hpp"

#include <functional>
#include <string>

#include <gtest/gtest.h>

namespace merkel {
namespace {

/// A run of 1000 ticks and 100 spikes with one sink, to which something happens.
std::vector<Finding> findings(const std::function<void(RunReport&)>& happen) {
  const TactileModel model = *TactileModel::create({});
  RunReport report;
  report.ticks = 1000;
  report.spikes = 100;
  report.probes.resize(1);
  report.sinks.push_back({.uri = "zmq:", .spikes_in = 100, .delivered = 100});
  happen(report);
  return verdict_of(report, model);
}

/// Exit codes without and with --strict, and the first sentence.
struct Outcome {
  bool failed = false;
  bool failed_strictly = false;
  std::string sentence;
};
Outcome outcome(const std::function<void(RunReport&)>& happen) {
  const auto all = findings(happen);
  return {failed(all, false), failed(all, true), all.empty() ? "" : all.front().sentence};
}

TEST(Verdict, ARunThatLostNothingIsDone) {
  const Outcome run = outcome([](RunReport&) {});
  EXPECT_FALSE(run.failed);
  EXPECT_FALSE(run.failed_strictly);
  EXPECT_EQ(run.sentence, "");
}

TEST(Verdict, ALostSpikeFailsTheRun) {
  const Outcome dropped = outcome([](RunReport& report) {
    report.sinks[0].dropped = 1;
    report.sinks[0].delivered = 99;
  });
  EXPECT_TRUE(dropped.failed);
  EXPECT_EQ(dropped.sentence, "1 of 100 spikes did not reach zmq:");
  EXPECT_TRUE(outcome([](RunReport& report) { report.sinks[0].delivered = 99; }).failed);
}

TEST(Verdict, ASinkWithoutSpikesLosesNone) {
  EXPECT_FALSE(outcome([](RunReport& report) {
                 report.sinks.push_back({.uri = "stim-csv:x", .commands_in = 20});
               }).failed_strictly);
}

TEST(Verdict, ALostStimulationCommandFailsTheRun) {
  const Outcome run = outcome([](RunReport& report) {
    report.commands = 50;
    report.commands_dropped = 2;
  });
  EXPECT_TRUE(run.failed);
  EXPECT_EQ(run.sentence, "2 of 50 stimulation commands were lost, so stimulation was stopped");
}

TEST(Verdict, MoreThanAHundredthOfTheTicksSkippedFailsTheRun) {
  const auto skipped = [](std::uint64_t ticks) {
    return outcome([ticks](RunReport& report) {
      report.skipped_ticks = ticks;
      report.ticks -= ticks;
    });
  };
  EXPECT_FALSE(skipped(10).failed);
  EXPECT_TRUE(skipped(10).failed_strictly);
  EXPECT_TRUE(skipped(11).failed);
  EXPECT_EQ(skipped(11).sentence, "11 of 1000 ticks were skipped: the simulation fell behind");
}

TEST(Verdict, DemotionFailsTheRun) {
  EXPECT_TRUE(outcome([](RunReport& report) { report.demotions = 1; }).failed);
}

TEST(Verdict, LateTicksFailStrictRunsOnly) {
  const Outcome run = outcome([](RunReport& report) { report.overruns = 500; });
  EXPECT_FALSE(run.failed);
  EXPECT_TRUE(run.failed_strictly);
}

}  // namespace
}  // namespace merkel
