#include "tools/doctor/path_verdicts.hpp"

#include <algorithm>

#include <fmt/core.h>

#include "core/units.hpp"
#include "tools/run/loop_summary.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::nanoseconds;
using Grade = Verdict::Grade;

Verdict of_wake_up(const LatencySummary& wake_up) {
  const nanoseconds late = wake_up.p999;
  const std::string text = latency_text(wake_up);
  const auto within = [&text](const char* band) { return text + ": " + band; };
  if (wake_up.count == 0) return {Grade::kUnknown, "wake-up latency", "no tick waited", ""};
  if (late <= microseconds{20}) {
    return {Grade::kGood, "wake-up latency", within("99.9 % within 20 µs"), ""};
  }
  if (late <= microseconds{50}) {
    return {Grade::kGood, "wake-up latency", within("99.9 % within 50 µs"), ""};
  }
  if (late <= microseconds{500}) {
    return {Grade::kFair, "wake-up latency", within("99.9 % within 500 µs"),
            "enough for ticks of 1 ms; for shorter ticks, reduce the load of this machine or use a "
            "PREEMPT_RT kernel with an isolated core ([loop] cpu)"};
  }
  return {Grade::kPoor, "wake-up latency", within("0.1 % beyond 500 µs"),
          "grant real-time priority, reduce the load of this machine, or trace the kernel: "
          "sudo hwlatdetect, sudo trace-cmd record -p wakeup_rt"};
}

Verdict of_missed(const std::vector<DoctorRun>& runs) {
  std::uint64_t missed = 0;
  std::uint64_t all = 0;
  std::uint64_t late = 0;
  nanoseconds steal{0};
  for (const DoctorRun& run : runs) {
    missed += run.path.missed();
    late += run.path.report.overruns_by_late_wake_up + run.path.report.skipped_ticks;
    all += run.path.report.ticks + run.path.report.skipped_ticks;
    steal += run.path.steal;
  }
  const double percent =
      all > 0 ? 100.0 * static_cast<double>(missed) / static_cast<double>(all) : 0.0;
  const std::string text = fmt::format(
      "{} of {} ({:.3f} %), {} of them by late wake-ups; the hypervisor took {:.0f} ms of the "
      "cores' time",
      missed, all, percent, late, units::ms_from(steal));
  if (missed == 0) return {Grade::kGood, "missed ticks", text, ""};
  return {percent <= 0.1 ? Grade::kFair : Grade::kPoor, "missed ticks", text,
          percent <= 0.1 ? "" : "increase [loop] tick_us, or fix the poor results above"};
}

Verdict of_software(const ConsumerLatency& consumer, const LatencySummary& software) {
  const std::string what = std::string("software latency, ") + consumer.name;
  if (software.count == 0) return {Grade::kUnknown, what, "no spike arrived", ""};
  const bool good = software.p50 <= consumer.good;
  return {good ? Grade::kGood : Grade::kFair, what, latency_text(software),
          good ? ""
               : fmt::format("reduce the load of this machine: half of all spikes take more than "
                             "{:.0f} µs on top of the jitter buffer and the tick",
                             units::us_from(consumer.good))};
}

Verdict of_sample_to_spike(const LatencySummary& latency) {
  if (latency.count == 0)
    return {Grade::kUnknown, "sample to spike", "no tick contained spikes", ""};
  const bool good = latency.p50 <= microseconds{1700};
  return {good ? Grade::kGood : Grade::kFair, "sample to spike", latency_text(latency),
          good
              ? ""
              : "samples arrive irregularly, so the loop waits longer for them: reduce the load of "
                "this machine, or set [loop] interpolation = \"hold\""};
}

}  // namespace

LatencySummary median_of(std::vector<LatencySummary> summaries) {
  LatencySummary median;
  if (summaries.empty()) return median;
  const auto middle = [&summaries](nanoseconds LatencySummary::*figure) {
    std::sort(summaries.begin(), summaries.end(),
              [figure](const auto& a, const auto& b) { return a.*figure < b.*figure; });
    return summaries[summaries.size() / 2].*figure;
  };
  for (const LatencySummary& summary : summaries) median.count += summary.count;
  median.p50 = middle(&LatencySummary::p50);
  median.p99 = middle(&LatencySummary::p99);
  median.p999 = middle(&LatencySummary::p999);
  median.longest = middle(&LatencySummary::longest);
  return median;
}

std::vector<Verdict> path_verdicts(const std::vector<DoctorRun>& runs) {
  std::vector<LatencySummary> wake_ups;
  std::vector<LatencySummary> cyclictests;
  std::uint64_t missing = 0;
  for (const DoctorRun& run : runs) {
    wake_ups.push_back(run.path.report.host_time->wake_up);
    for (const ConsumerLatency& consumer : run.path.consumers) missing += consumer.missing;
    if (run.cyclictest) cyclictests.push_back(*run.cyclictest);
  }
  const LatencySummary wake_up = median_of(wake_ups);
  std::vector<LatencySummary> from_sample;
  for (const DoctorRun& run : runs) {
    from_sample.push_back(run.path.report.host_time->sample_to_spike);
  }
  std::vector<Verdict> verdicts = {of_sample_to_spike(median_of(from_sample)), of_wake_up(wake_up),
                                   of_missed(runs)};
  for (std::size_t i = 0; i < runs.front().path.consumers.size(); ++i) {
    std::vector<LatencySummary> software;
    for (const DoctorRun& run : runs) software.push_back(run.path.consumers[i].software);
    verdicts.push_back(of_software(runs.front().path.consumers[i], median_of(software)));
  }
  verdicts.push_back(
      {missing == 0 ? Grade::kGood : Grade::kPoor, "lost spikes", std::to_string(missing),
       missing == 0 ? "" : "a consumer was too slow: reduce the load of this machine"});
  if (cyclictests.empty()) {
    verdicts.push_back({Grade::kUnknown, "cyclictest", "not measured", "apt install rt-tests"});
    return verdicts;
  }
  const LatencySummary beside = median_of(cyclictests);
  const bool no_worse = wake_up.p99 <= beside.p99;
  verdicts.push_back({no_worse ? Grade::kGood : Grade::kFair, "cyclictest",
                      latency_text(beside) +
                          (no_worse ? ": the loop's p99 is no worse" : ": the loop's p99 is worse"),
                      ""});
  return verdicts;
}

}  // namespace merkel
