#include "drivers/probes/sample_meter.hpp"

#include <algorithm>
#include <cmath>

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr nanoseconds kStepWindow{1'000'000'000};
constexpr std::size_t kMinSteps = 4;  ///< fewest steps of a window
constexpr std::size_t kMaxKeptSteps = 2000;
constexpr double kQuantile = 0.999;
constexpr int kOutage = 4;  ///< periods without a sample
/// While a device is opened, its first samples wait for their reader.
constexpr milliseconds kOpening{100};
constexpr microseconds kMinMargin{50};
constexpr int kMarginShare = 20;  ///< margin added, as a share of the jitter
constexpr microseconds kMinChange{250};
constexpr std::size_t kWindows = 5;  ///< whose median applies
constexpr milliseconds kMinStale{50};
constexpr int kStaleDelays = 3;

nanoseconds quantile(std::vector<nanoseconds> values, double share) {
  const auto last = static_cast<double>(values.size() - 1);
  const auto chosen = values.begin() + static_cast<std::ptrdiff_t>(std::lround(last * share));
  std::nth_element(values.begin(), chosen, values.end());
  return *chosen;
}

}  // namespace

nanoseconds SampleMeter::stale_after(nanoseconds delay) noexcept {
  return std::max<nanoseconds>(kMinStale, kStaleDelays * delay);
}

bool SampleMeter::window_is_over(const ReadingHead& sample) const noexcept {
  if (steps_.size() >= kMaxKeptSteps) return true;
  return steps_.size() >= kMinSteps && sample.arrival - window_begin_ >= kStepWindow;
}

bool SampleMeter::add(const ReadingHead& sample) {
  bool changed = false;
  if (!last_) {
    window_begin_ = sample.arrival;
    opened_ = sample.arrival + kOpening;
  } else if (sample.arrival >= opened_) {
    steps_.push_back({.interval = sample.time - last_->time,
                      .need = sample.arrival - last_->time,
                      .latency = sample.arrival - sample.time});
    if (window_is_over(sample)) {
      changed = close_window();
      steps_.clear();
      window_begin_ = sample.arrival;
    }
  }
  last_ = sample;
  return changed;
}

bool SampleMeter::finish() {
  if (timing_ || steps_.empty()) return false;
  return close_window();
}

SampleTiming SampleMeter::timing_of_window() const {
  std::vector<Time> intervals;
  for (const Step& step : steps_) intervals.push_back(step.interval);
  const Time period = quantile(std::move(intervals), 0.5);
  std::vector<Time> needs;
  std::vector<Time> latencies;
  for (const Step& step : steps_) {
    if (step.interval > kOutage * period) continue;
    needs.push_back(step.need);
    latencies.push_back(step.latency);
  }
  const Time need = quantile(std::move(needs), kQuantile);
  const Time latency = std::max(quantile(std::move(latencies), kQuantile), Time{0});
  const Time jitter = std::max(need - period, Time{0});
  const Time margin = std::max<Time>(kMinMargin, jitter / kMarginShare);
  SampleTiming timing{.period = period,
                      .jitter = jitter,
                      .delay = period + jitter + margin,
                      .delay_of_newest = latency + margin};
  // Of samples that arrive in bursts, the loop waits for a part only.
  timing.stale_after =
      stale_after(std::min(timing.delay, SampleTiming::delay_ceiling(timing.period)));
  return timing;
}

bool SampleMeter::close_window() {
  const SampleTiming now = timing_of_window();
  const bool another_rate =
      timing_ && (now.period > timing_->period * 3 / 2 || now.period < timing_->period * 2 / 3);
  if (another_rate) windows_.clear();
  if (windows_.size() == kWindows) windows_.erase(windows_.begin());
  windows_.push_back(now);
  auto sorted = windows_;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>((sorted.size() - 1) / 2);
  std::nth_element(sorted.begin(), middle, sorted.end(),
                   [](const auto& x, const auto& y) { return x.delay < y.delay; });
  const Time change = timing_ ? std::chrono::abs(middle->delay - timing_->delay) : Time::max();
  const Time allowance = timing_ ? std::max<Time>(kMinChange, timing_->delay / 10) : Time::zero();
  if (change <= allowance && !another_rate) return false;
  timing_ = *middle;
  return true;
}

}  // namespace merkel
