#include "drivers/clock/pulse_match.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "core/parameters/parameter_error.hpp"

namespace merkel {
namespace {

using Nanoseconds = std::chrono::nanoseconds;

constexpr double kLargestDrift = 1e-3;     ///< of one clock against the other
constexpr double kRateWalk = 1e-14;        ///< variance of the drift that a second adds
constexpr std::size_t kMinPulses = 8;      ///< that must match
constexpr std::size_t kSeedIntervals = 3;  ///< a place is tried if these are alike
constexpr std::size_t kMaxSeeds = 1024;
constexpr std::size_t kMaxPlaces = 64;  ///< of a seed; more: it tells nothing
constexpr std::size_t kBlock = 16;      ///< pulses
constexpr std::uint32_t kUnmatched = UINT32_MAX;

/// A number with at most three decimals.
std::string thousandths(double value) { return shortest_decimal(std::round(1e3 * value) / 1e3); }

/// Times in s from the first one.
std::vector<double> seconds_of(std::span<const Nanoseconds> times) {
  std::vector<double> all;
  all.reserve(times.size());
  for (const Nanoseconds each : times) {
    all.push_back(1e-9 * static_cast<double>((each - times.front()).count()));
  }
  return all;
}

/// An interval than which one in ten is shorter.
double short_interval(const std::vector<double>& times) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < times.size(); ++i) intervals.push_back(times[i] - times[i - 1]);
  const auto tenth = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 10);
  std::nth_element(intervals.begin(), tenth, intervals.end());
  return *tenth;
}

/// Follows the time of one clock on the other: a Kalman filter of offset and drift.
class ClockFollower {
 public:
  ClockFollower(double x, double y, double drift, double drift_sigma, double tolerance)
      : x_(x), y_(y), drift_(drift), noise_(tolerance * tolerance / 9.0), tolerance_(tolerance) {
    yy_ = noise_;
    dd_ = drift_sigma * drift_sigma;
  }

  void go_to(double x) {
    const double step = x - x_;
    x_ = x;
    y_ += (1.0 + drift_) * step;
    yy_ += 2.0 * step * yd_ + step * step * dd_;
    yd_ += step * dd_;
    dd_ += kRateWalk * std::fabs(step);
  }
  void see(double y) {
    const double error = y - y_;
    const double gain_y = yy_ / (yy_ + noise_);
    const double gain_d = yd_ / (yy_ + noise_);
    y_ += gain_y * error;
    drift_ += gain_d * error;
    dd_ -= gain_d * yd_;
    yd_ *= 1.0 - gain_y;
    yy_ *= 1.0 - gain_y;
  }
  [[nodiscard]] double expected() const { return y_; }
  [[nodiscard]] double gate() const { return tolerance_ + 3.0 * std::sqrt(yy_); }
  [[nodiscard]] double drift() const { return drift_; }

 private:
  double x_;
  double y_;
  double drift_;
  double noise_;
  double tolerance_;
  double yy_ = 0.0;
  double yd_ = 0.0;
  double dd_ = 0.0;
};

/// The partners of the pulses `x` among `y`, where one pair of them is assumed.
struct Placement {
  std::vector<std::uint32_t> partner;
  std::size_t matched = 0;
  double drift = 0.0;

  /// Pulses that have the same partner in another one.
  [[nodiscard]] std::size_t agreeing(const Placement& other) const {
    std::size_t count = 0;
    for (std::size_t i = 0; i < partner.size(); ++i) {
      count += partner[i] != kUnmatched && partner[i] == other.partner[i] ? 1U : 0U;
    }
    return count;
  }
  [[nodiscard]] std::size_t total_within(std::size_t begin, std::size_t end) const {
    return static_cast<std::size_t>(
        std::count_if(partner.begin() + static_cast<std::ptrdiff_t>(begin),
                      partner.begin() + static_cast<std::ptrdiff_t>(end),
                      [](std::uint32_t each) { return each != kUnmatched; }));
  }
};

/// Goes on from a pair in one direction, until the other sequence ends or nothing fits any more.
void extend(const std::vector<double>& x, const std::vector<double>& y, std::size_t i,
            std::size_t j, bool forward, double drift_sigma, double tolerance,
            Placement& placement) {
  ClockFollower clock(x[i], y[j], placement.drift, drift_sigma, tolerance);
  std::size_t missed = 0;
  std::size_t next = j;  // the last partner
  const std::size_t matched_before = placement.matched;
  while (forward ? ++i < x.size() : i-- > 0) {
    clock.go_to(x[i]);
    const double expected = clock.expected();
    if (expected < y.front() - clock.gate() || expected > y.back() + clock.gate()) break;
    const auto after =
        static_cast<std::size_t>(std::lower_bound(y.begin(), y.end(), expected) - y.begin());
    std::size_t best = after;
    if (after == y.size() || (after > 0 && expected - y[after - 1] < y[after] - expected)) {
      best = after - 1;
    }
    const bool in_order = forward ? best > next : best < next;
    if (!in_order || std::fabs(y[best] - expected) > clock.gate()) {
      if (++missed > 2 * kBlock + placement.matched - matched_before) break;
      continue;
    }
    placement.partner[i] = static_cast<std::uint32_t>(best);
    ++placement.matched;
    next = best;
    clock.see(y[best]);
  }
  placement.drift = clock.drift();
}

Placement place(const std::vector<double>& x, const std::vector<double>& y, std::size_t i,
                std::size_t j, double tolerance) {
  Placement placement{.partner = std::vector<std::uint32_t>(x.size(), kUnmatched)};
  placement.partner[i] = static_cast<std::uint32_t>(j);
  placement.matched = 1;
  extend(x, y, i, j, true, kLargestDrift, tolerance, placement);
  const bool known = placement.matched > 2 * kBlock;
  if (!known) placement.drift = 0.0;
  extend(x, y, i, j, false, known ? 1e-5 : kLargestDrift, tolerance, placement);
  return placement;
}

/// Looks for the places of `x` in `y`, whose pulses are at least as many.
class PlaceSearch {
 public:
  PlaceSearch(const std::vector<double>& x, const std::vector<double>& y, double tolerance)
      : x_(x), y_(y), tolerance_(tolerance) {
    for (std::size_t j = 1; j < y.size(); ++j) by_length_.emplace_back(y[j] - y[j - 1], j - 1);
    std::sort(by_length_.begin(), by_length_.end());
  }

  void run() {
    const std::size_t starts = x_.size() - kSeedIntervals;
    const std::size_t seeds = std::min(starts, kMaxSeeds);
    for (std::size_t k = 0; k < seeds; ++k)
      try_seed(k * (starts - 1) / std::max(seeds - 1, std::size_t{1}));
  }
  /// All that were tried; the most matches first.
  [[nodiscard]] std::vector<Placement>& placements() {
    std::stable_sort(placements_.begin(), placements_.end(),
                     [](const auto& a, const auto& b) { return a.matched > b.matched; });
    return placements_;
  }
  /// Most of the seeds fit in too many places.
  [[nodiscard]] bool regular() const { return 2 * regular_ > tried_; }

 private:
  void try_seed(std::size_t i) {
    ++tried_;
    const auto slack = [&](double length) { return 2.0 * tolerance_ + kLargestDrift * length; };
    const double first = x_[i + 1] - x_[i];
    std::vector<std::size_t> places;
    auto each = std::lower_bound(by_length_.begin(), by_length_.end(),
                                 std::pair(first - slack(first), std::size_t{0}));
    for (; each != by_length_.end() && each->first <= first + slack(first); ++each) {
      const std::size_t j = each->second;
      bool alike = j + kSeedIntervals < y_.size();
      for (std::size_t k = 1; alike && k < kSeedIntervals; ++k) {
        const double here = x_[i + k + 1] - x_[i + k];
        alike = std::fabs(y_[j + k + 1] - y_[j + k] - here) <= slack(here);
      }
      if (!alike) continue;
      places.push_back(j);
      if (places.size() > kMaxPlaces) {
        ++regular_;
        return;
      }
    }
    for (const std::size_t j : places) {
      const bool known = std::any_of(placements_.begin(), placements_.end(),
                                     [&](const Placement& other) { return other.partner[i] == j; });
      if (known) continue;
      Placement placement = place(x_, y_, i, j, tolerance_);
      const bool same =
          std::any_of(placements_.begin(), placements_.end(), [&](const Placement& other) {
            return 2 * placement.agreeing(other) > placement.matched;
          });
      if (placement.matched >= kMinPulses && !same) placements_.push_back(std::move(placement));
    }
  }

  const std::vector<double>& x_;
  const std::vector<double>& y_;
  double tolerance_;
  std::vector<std::pair<double, std::size_t>> by_length_;  ///< intervals of y, with their begin
  std::vector<Placement> placements_;
  std::size_t tried_ = 0;
  std::size_t regular_ = 0;
};

/// The time of one clock on the other, by a line through two pairs of pulses.
struct PairLine {
  double x = 0.0;
  double y = 0.0;
  double pace = 1.0;

  [[nodiscard]] double x_at(double time_y) const { return x + (time_y - y) / pace; }
  [[nodiscard]] PairLine inverse() const { return {y, x, 1.0 / pace}; }
};

/// Indices, [first, second).
using Part = std::pair<std::size_t, std::size_t>;

/// The pulses of `x` within the time of `y`.
Part common_part(const std::vector<double>& x, const std::vector<double>& y, const PairLine& line,
                 double tolerance) {
  const auto begin = std::lower_bound(x.begin(), x.end(), line.x_at(y.front()) - tolerance);
  const auto end = std::upper_bound(x.begin(), x.end(), line.x_at(y.back()) + tolerance);
  return {static_cast<std::size_t>(begin - x.begin()), static_cast<std::size_t>(end - x.begin())};
}

/// Two places fit, and the same pulses match in them.
bool ambiguous(const std::vector<Placement>& found) {
  if (found.size() < 2 || 2 * found[1].matched <= found[0].matched) return false;
  std::size_t both = 0;
  for (std::size_t i = 0; i < found[0].partner.size(); ++i) {
    if (found[0].partner[i] != kUnmatched && found[1].partner[i] != kUnmatched) ++both;
  }
  return 4 * both > found[1].matched;
}

/// The part that matches, if at an end of the common part both clocks have pulses that do not: one
/// has jumped.
std::optional<Part> cut_short(const std::vector<double>& x, const std::vector<double>& y,
                              const PairLine& line, const Placement& best, const Part& common) {
  const auto [begin, end] = common;
  Part good{end, begin};
  for (std::size_t i = begin; i < end; i += kBlock) {
    const std::size_t stop = std::min(i + kBlock, end);
    if (2 * best.total_within(i, stop) < stop - i) continue;
    good = {std::min(good.first, i), stop};
  }
  const auto misses = [&](std::size_t a, std::size_t b) {
    if (b < a + 2 * kBlock + 1) return false;
    return std::count_if(y.begin(), y.end(), [&](double time) {
             return line.x_at(time) >= x[a] && line.x_at(time) <= x[b - 1];
           }) > static_cast<std::ptrdiff_t>(2 * kBlock);
  };
  if (misses(begin, good.first) || misses(good.second, end)) return good;
  return std::nullopt;
}

}  // namespace

Expected<PulseMatch, std::string> match_pulses(std::span<const Nanoseconds> from,
                                               std::span<const Nanoseconds> to,
                                               Nanoseconds tolerance) {
  using Failure = Unexpected<std::string>;
  if (std::min(from.size(), to.size()) < kMinPulses) {
    return Failure("there are " + std::to_string(from.size()) + " pulses and " +
                   std::to_string(to.size()) + ", and a match needs at least " +
                   std::to_string(kMinPulses));
  }
  const bool swapped = to.size() < from.size();
  const std::vector<double> x = seconds_of(swapped ? to : from);
  const std::vector<double> y = seconds_of(swapped ? from : to);
  const double most =
      std::min(1e-9 * static_cast<double>(tolerance.count()),
               std::min(short_interval(x), short_interval(y)) / static_cast<double>(kMinPulses));
  PlaceSearch search(x, y, most);
  search.run();
  const std::vector<Placement>& found = search.placements();
  if (found.empty() || found.front().matched < kMinPulses) {
    if (search.regular()) {
      return Failure(
          "the intervals of the pulses are too alike to tell one place from another: use pulses at "
          "irregular intervals");
    }
    return Failure("no place fits: no " + std::to_string(kMinPulses) +
                   " pulses have the same intervals to within " + thousandths(1e3 * most) + " ms");
  }
  const Placement& best = found.front();
  Part ends{x.size(), 0};  // of what matches
  PulseMatch match;
  match.tolerance = Nanoseconds{std::llround(1e9 * most)};
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (best.partner[i] == kUnmatched) continue;
    const std::size_t j = best.partner[i];
    ends = {std::min(ends.first, i), i};
    match.pairs.push_back({.from = from[swapped ? j : i], .to = to[swapped ? i : j]});
  }
  const double span = x[ends.second] - x[ends.first];
  const double y_first = y[best.partner[ends.first]];
  const PairLine line{x[ends.first], y_first, (y[best.partner[ends.second]] - y_first) / span};
  const Part common = common_part(x, y, line, most);
  const Part other = common_part(y, x, line.inverse(), most);
  match.total = common.second - common.first;
  match.total_other = other.second - other.first;
  if (swapped) std::swap(match.total, match.total_other);
  const std::size_t in_both = std::min(match.total, match.total_other);
  if (ambiguous(found)) {
    return Failure("two places fit, with " + std::to_string(best.matched) + " and " +
                   std::to_string(found[1].matched) +
                   " matching pulses: use pulses at irregular intervals");
  }
  if (2 * best.matched < in_both) {
    return Failure("no place fits: at best " + std::to_string(best.matched) + " of " +
                   std::to_string(in_both) + " pulses have the same intervals to within " +
                   thousandths(1e3 * most) + " ms");
  }
  if (std::fabs(line.pace - 1.0) > kLargestDrift + 2.0 * most / span) {
    return Failure("the clocks differ by " + thousandths(1e2 * std::fabs(line.pace - 1.0)) +
                   " %, but those of recorders by at most " + thousandths(1e2 * kLargestDrift) +
                   " %: one of them has another sampling rate than its file says");
  }
  if (const auto good = cut_short(x, y, line, best, common)) {
    return Failure("they match only over " + thousandths(x[good->second - 1] - x[good->first]) +
                   " s of " + thousandths(x[common.second - 1] - x[common.first]) +
                   " s: one recorder was stopped and started again, or its clock has jumped; cut "
                   "the file of pulses there, and align each part");
  }
  return match;
}

}  // namespace merkel
