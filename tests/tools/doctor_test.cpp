#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "core/math/random.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/program.hpp"
#include "tools/child_process.hpp"
#include "tools/doctor/cyclictest.hpp"
#include "tools/doctor/machine_verdicts.hpp"
#include "tools/doctor/path_verdicts.hpp"
#include "tools/doctor/spike_matcher.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using Grade = Verdict::Grade;

/// A tick that ended at a probe time, 2 ms before it was due, and took 10 µs.
TickTiming tick_ending(milliseconds end) {
  const nanoseconds due = end + milliseconds{2};
  return {.end = end,
          .arrival = end + microseconds{100},
          .due = due,
          .started = due + microseconds{1},
          .computed = due + microseconds{9},
          .published = due + microseconds{10}};
}

TEST(SpikeMatcher, MeasuresEachSpikeAgainstItsTick) {
  SpikeMatcher matcher(milliseconds{1});
  for (const int ms : {5, 7, 8}) matcher.add(tick_ending(milliseconds{ms}));
  for (const auto spike : {microseconds{4100}, microseconds{5000}, microseconds{7500}}) {
    const auto end = std::chrono::ceil<milliseconds>(spike);
    matcher.add({.spike = spike, .arrival = end + milliseconds{2} + microseconds{40}});
  }
  matcher.match();
  EXPECT_EQ(matcher.software().count, 3U);
  EXPECT_EQ(matcher.software().longest, microseconds{40});
  EXPECT_EQ(matcher.sink().longest, microseconds{30});
  EXPECT_EQ(matcher.sample_to_received().longest, microseconds{1940});
  EXPECT_EQ(matcher.unmatched(), 0U);
}

TEST(SpikeMatcher, WaitsForATickThatHasNotBeenAddedYet) {
  SpikeMatcher matcher(milliseconds{1});
  matcher.add({.spike = microseconds{4500}, .arrival = milliseconds{8}});
  matcher.match();
  EXPECT_EQ(matcher.software().count, 0U);
  matcher.add(tick_ending(milliseconds{5}));
  matcher.match();
  EXPECT_EQ(matcher.software().count, 1U);
}

TEST(SpikeMatcher, CountsSpikesWhoseTickIsNotKnown) {
  SpikeMatcher matcher(milliseconds{1});
  matcher.add(tick_ending(milliseconds{9}));
  matcher.add({.spike = microseconds{4500}, .arrival = milliseconds{8}});
  matcher.add({.spike = microseconds{8500}, .arrival = milliseconds{12}});
  matcher.match();
  EXPECT_EQ(matcher.unmatched(), 1U);
  EXPECT_EQ(matcher.software().count, 1U);
}

const std::string kCyclictest = R"({"num_threads": 1, "thread": {"0": {"histogram":
  {"10": 500, "20": 480, "30": 15, "400": 4}, "cycles": 1000, "min": 10, "max": 25000}}})";

TEST(Cyclictest, ItsHistogramIsRead) {
  const auto summary = parse_cyclictest(kCyclictest);
  ASSERT_TRUE(summary);
  EXPECT_EQ(summary->count, 1000U);
  EXPECT_EQ(summary->p50, microseconds{10});
  EXPECT_EQ(summary->p99, microseconds{30});
  EXPECT_EQ(summary->p999, microseconds{400});
  EXPECT_EQ(summary->longest, microseconds{25000});  // beyond the range of the histogram
}

TEST(Cyclictest, OtherTextIsRefusedWithoutHarm) {
  for (const char* text : {"", "{}", "[]", "null", "{\"thread\": 1}", "{\"thread\": {\"0\": []}}",
                           "{\"thread\": {\"0\": {\"histogram\": {\"x\": 1}}}}",
                           "{\"thread\": {\"0\": {\"histogram\": {}}}}"}) {
    EXPECT_FALSE(parse_cyclictest(text)) << text;
  }
  Random random(3);
  for (int i = 0; i < 2000; ++i) {
    std::string text = kCyclictest;
    for (int k = 0; k < 3; ++k) {
      const auto at = static_cast<std::size_t>(random.uniform() * static_cast<double>(text.size()));
      text[at] = static_cast<char>(32.0 + 94.0 * random.uniform());
    }
    static_cast<void>(parse_cyclictest(text));  // must not throw for any text
  }
}

TEST(ChildProcess, ReportsItsExitAndEndsWithItsOwner) {
  EXPECT_EQ(ChildProcess({"true"}).wait(), 0);
  EXPECT_EQ(ChildProcess({"false"}).wait(), 1);
  EXPECT_FALSE(ChildProcess({"no-such-program-anywhere"}).started());
  EXPECT_EQ(ChildProcess({"no-such-program-anywhere"}).wait(), -1);
  const ChildProcess endless({"sleep", "1000"});
  EXPECT_TRUE(endless.started());
}

/// A machine described by files in a folder.
class MachineTest : public testing::Test {
 protected:
  void file(const std::string& path, const std::string& text) {
    const std::filesystem::path full = folder_.path("root") + path;
    std::filesystem::create_directories(full.parent_path());
    std::ofstream(full) << text << "\n";
  }
  std::string root() { return folder_.path("root"); }
  const Verdict* find(const std::vector<Verdict>& verdicts, const std::string& what) {
    for (const Verdict& verdict : verdicts) {
      if (verdict.what == what) return &verdict;
    }
    ADD_FAILURE() << "there is no verdict on " << what;
    return nullptr;
  }
  TemporaryFolder folder_;
};

TEST_F(MachineTest, AGoodMachineNeedsNoRemedy) {
  file("/proc/version", "Linux version 6.1.0 #1 SMP PREEMPT_RT Debian");
  file("/proc/cpuinfo", "flags : fpu tsc sse2");
  file("/proc/sys/kernel/sched_rt_runtime_us", "950000");
  file("/sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc");
  file("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "performance");
  MachineFacts facts = MachineFacts::read(root());
  facts.rights = {.cap_sys_nice = true, .cap_ipc_lock = true};
  EXPECT_TRUE(facts.realtime_kernel);
  EXPECT_FALSE(facts.hypervisor);
  for (const Verdict& verdict : machine_verdicts(facts, 70)) {
    EXPECT_EQ(verdict.grade, Grade::kGood) << verdict.what;
    EXPECT_EQ(verdict.remedy, "") << verdict.what;
  }
}

TEST_F(MachineTest, EveryFaultHasARemedy) {
  file("/proc/version", "Linux version 6.1.0 #1 SMP PREEMPT_DYNAMIC Debian");
  file("/proc/cpuinfo", "flags : fpu tsc hypervisor sse2");
  file("/proc/sys/kernel/sched_rt_runtime_us", "0");
  file("/sys/devices/system/clocksource/clocksource0/current_clocksource", "hpet");
  file("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "powersave");
  file("/dev/ttyUSB0", "");
  file("/sys/bus/usb-serial/devices/ttyUSB0/latency_timer", "16");
  MachineFacts facts = MachineFacts::read(root());
  facts.rights = {};
  ASSERT_EQ(facts.ports.size(), 1U);
  facts.ports[0].accessible = false;  // root may open every port
  const auto verdicts = machine_verdicts(facts, 70);
  for (const Verdict& verdict : verdicts) {
    EXPECT_NE(verdict.grade, Grade::kGood) << verdict.what;
    EXPECT_NE(verdict.remedy, "") << verdict.what;
  }
  EXPECT_NE(find(verdicts, "latency timer of /dev/ttyUSB0")->remedy.find("echo 1"),
            std::string::npos);
  EXPECT_NE(find(verdicts, "port /dev/ttyUSB0")->remedy.find("dialout"), std::string::npos);
  EXPECT_NE(find(verdicts, "frequency governor")->remedy.find("performance"), std::string::npos);
  EXPECT_EQ(find(verdicts, "real-time priority")->grade, Grade::kPoor);
}

TEST_F(MachineTest, AbsentFactsHaveNoVerdict) {
  std::filesystem::create_directories(root());
  const MachineFacts facts = MachineFacts::read(root());
  EXPECT_TRUE(facts.ports.empty());
  EXPECT_EQ(machine_verdicts(facts, 70).size(), 3U);  // the rights and the kernel
}

LatencySummary latency(int p50_us, int p99_us, int p999_us) {
  return {.count = 1000,
          .p50 = microseconds{p50_us},
          .p99 = microseconds{p99_us},
          .p999 = microseconds{p999_us},
          .longest = microseconds{2 * p999_us}};
}

DoctorRun run_of(const LatencySummary& wake_up, const LatencySummary& software,
                 std::uint64_t overruns) {
  DoctorRun run;
  run.path.report.host_time.emplace();
  run.path.report.host_time->wake_up = wake_up;
  run.path.report.ticks = 10'000;
  run.path.report.overruns = overruns;
  run.path.consumers = {
      {.name = "polling consumer", .good = microseconds{60}, .software = software},
      {.name = "ZeroMQ subscriber", .good = microseconds{500}, .software = software}};
  return run;
}

TEST(PathVerdicts, BandsAreThoseOfTheMedian) {
  const auto grades = [](const DoctorRun& run) {
    std::vector<Grade> all;
    for (const Verdict& verdict : path_verdicts({run})) all.push_back(verdict.grade);
    return all;
  };
  using G = Grade;
  EXPECT_EQ(
      grades(run_of(latency(1, 2, 50), latency(60, 100, 200), 0)),
      (std::vector{G::kUnknown, G::kGood, G::kGood, G::kGood, G::kGood, G::kGood, G::kUnknown}));
  EXPECT_EQ(
      grades(run_of(latency(1, 2, 500), latency(61, 100, 200), 10)),
      (std::vector{G::kUnknown, G::kFair, G::kFair, G::kFair, G::kGood, G::kGood, G::kUnknown}));
  EXPECT_EQ(
      grades(run_of(latency(1, 2, 501), latency(501, 600, 700), 11)),
      (std::vector{G::kUnknown, G::kPoor, G::kPoor, G::kFair, G::kFair, G::kGood, G::kUnknown}));
  DoctorRun beside = run_of(latency(1, 20, 30), latency(40, 100, 200), 0);
  beside.cyclictest = latency(15, 20, 100);
  EXPECT_EQ(path_verdicts({beside}).back().grade, G::kGood);
  beside.cyclictest = latency(15, 19, 100);
  EXPECT_EQ(path_verdicts({beside}).back().grade, G::kFair);
  const LatencySummary median =
      median_of({latency(1, 9, 30), latency(3, 7, 10), latency(2, 8, 20)});
  EXPECT_EQ(median.p50, microseconds{2});
  EXPECT_EQ(median.p99, microseconds{8});
  EXPECT_EQ(median.p999, microseconds{20});
  EXPECT_EQ(median.longest, microseconds{40});
  EXPECT_EQ(median.count, 3000U);
}

TEST(Doctor, MeasuresTheWholePathAndItsCountersAddUp) {
  const auto run = run_program({"doctor", "--seconds", "1", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto result = nlohmann::json::parse(run.out);
  ASSERT_EQ(result["runs"].size(), 1U);
  const auto& one = result["runs"][0];
  EXPECT_EQ(one["ticks"].get<int>() + one["skipped_ticks"].get<int>(), 1000);
  EXPECT_GT(one["spikes"].get<int>(), 20);
  EXPECT_EQ(one["samples_in"].get<int>(),
            one["samples_used"].get<int>() + one["samples_late"].get<int>() +
                one["samples_dropped"].get<int>() + one["samples_unused"].get<int>());
  for (const char* name : {"in_process", "zmq"}) {
    if (!one.contains(name)) GTEST_SKIP() << "built without ZeroMQ";
    const auto& consumer = one[name];
    EXPECT_EQ(consumer["spikes"].get<int>() + consumer["missing"].get<int>(),
              one["spikes"].get<int>());
    // Spikes of ticks that a busy host delayed at the start are not measured.
    EXPECT_EQ(consumer["software"]["count"].get<int>() + consumer["unmatched"].get<int>(),
              consumer["spikes"].get<int>());
    // The latency of the last stage is part of the total latency.
    EXPECT_LE(consumer["sink"]["p50_us"], consumer["software"]["p50_us"]);
    EXPECT_LE(consumer["software"]["p50_us"], consumer["sample_to_received"]["p50_us"]);
  }
  EXPECT_EQ(one["zmq"]["spikes"], one["spikes"]);
  EXPECT_GE(result["machine"].size(), 3U);
  EXPECT_EQ(result["verdicts"].size(), 7U);
}

TEST(Doctor, BrowsersThatHangLoseNoSpikes) {
  const auto run = run_program({"doctor", "--page", "--seconds", "0.5", "--json"});
  if (run.exit_code != 0 && run.err.find("without") != std::string::npos) GTEST_SKIP();
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto one = nlohmann::json::parse(run.out)["runs"][0];
  EXPECT_GT(one["spikes"].get<int>(), 10);
  EXPECT_EQ(one["in_process"]["missing"], 0);
  EXPECT_EQ(one["zmq"]["missing"], 0);
}

TEST(Doctor, MeasuresATickOf50Microseconds) {
  const auto run = run_program({"doctor", "--tick-us", "50", "--seconds", "0.5", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto one = nlohmann::json::parse(run.out)["runs"][0];
  EXPECT_EQ(one["ticks"].get<int>() + one["skipped_ticks"].get<int>(), 10000);
  EXPECT_GT(one["spikes"].get<int>(), 10);
  EXPECT_EQ(one["in_process"]["spikes"].get<int>() + one["in_process"]["missing"].get<int>(),
            one["spikes"].get<int>());
}

TEST(Doctor, ATickThatTheStepDoesNotDivideIsRefused) {
  const auto run = run_program({"doctor", "--tick-us", "110"});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_NE(run.err.find("must divide loop.tick_us"), std::string::npos) << run.err;
}

}  // namespace
}  // namespace merkel
