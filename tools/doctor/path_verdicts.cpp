#include "tools/doctor/path_verdicts.hpp"

#include <algorithm>

#include "core/units.hpp"
#include "tools/run/loop_summary.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::nanoseconds;

/// 99.9 % of the wake-ups are within so many µs; 0: not even within the last of them.
int band_of(const LatencySummary& wake_up) {
  for (const int band_us : {20, 50, 500}) {
    if (wake_up.p999 <= microseconds{band_us}) return band_us;
  }
  return 0;
}

Json missed_json(const std::vector<DoctorRun>& runs) {
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
  return {{"missed", missed},      {"all", all},   {"percent", percent},
          {"many", percent > 0.1}, {"late", late}, {"steal_ms", units::ms_from(steal)}};
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
  std::vector<LatencySummary> from_sample;
  std::vector<LatencySummary> cyclictests;
  std::vector<std::vector<LatencySummary>> software(runs.front().path.consumers.size());
  std::uint64_t missing = 0;
  for (const DoctorRun& run : runs) {
    wake_ups.push_back(run.path.report.host_time->wake_up);
    from_sample.push_back(run.path.report.host_time->sample_to_spike);
    if (run.cyclictest) cyclictests.push_back(*run.cyclictest);
    for (std::size_t i = 0; i < software.size(); ++i) {
      missing += run.path.consumers[i].missing;
      software[i].push_back(run.path.consumers[i].software);
    }
  }
  const LatencySummary sample_to_spike = median_of(from_sample);
  const LatencySummary wake_up = median_of(wake_ups);
  const LatencySummary beside = median_of(cyclictests);
  Json consumers = Json::array();
  for (std::size_t i = 0; i < software.size(); ++i) {
    const ConsumerLatency& consumer = runs.front().path.consumers[i];
    const LatencySummary median = median_of(software[i]);
    consumers.push_back({{"name", consumer.name},
                         {"software", latency_json(median)},
                         {"good", median.p50 <= consumer.good},
                         {"good_us", units::us_from(consumer.good)}});
  }
  return verdicts_of("doctor_path", {{"sample_to_spike", latency_json(sample_to_spike)},
                                     {"prompt", sample_to_spike.p50 <= microseconds{1700}},
                                     {"wake_up", latency_json(wake_up)},
                                     {"band", band_of(wake_up)},
                                     {"ticks", missed_json(runs)},
                                     {"consumers", std::move(consumers)},
                                     {"missing", missing},
                                     {"cyclictest", latency_json(beside)},
                                     {"no_worse", wake_up.p99 <= beside.p99}});
}

}  // namespace merkel
