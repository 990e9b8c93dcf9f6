#include "drivers/clock/clock_map.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "core/math/line_fit.hpp"

namespace merkel {
namespace {

using Time = std::chrono::nanoseconds;

constexpr double kLargestRate = 1e-3;  ///< between two oscillators
constexpr double kWander = 1e-6;       ///< of an oscillator's rate, with the temperature

double ns(Time time) { return static_cast<double>(time.count()); }
Time rounded(double time_ns) { return Time{std::llround(time_ns)}; }

/// How far `to` runs ahead from one reading to another, per time of `from`.
double rate_between(const ClockReading& a, const ClockReading& b) {
  return ns((b.to - a.to) - (b.from - a.from)) / ns(b.from - a.from);
}

/// What `to` runs ahead of `from` since the first event, by least squares over the time of `from`.
struct Line {
  FittedLine fitted;
  double largest_ns = 0.0;  ///< error of an event predicted by the others
};

Line line_through(const std::vector<ClockReading>& events) {
  const ClockReading& zero = events.front();
  const auto x = [&](const ClockReading& each) { return ns(each.from - zero.from); };
  const auto y = [&](const ClockReading& each) { return ns((each.to - zero.to)) - x(each); };
  Line line{.fitted = fit_line(events, x, y)};
  const FittedLine& fitted = line.fitted;
  for (const ClockReading& each : events) {
    const double from_mean = x(each) - fitted.mean_x;
    const double weight =
        1.0 / fitted.count + (fitted.xx > 0.0 ? from_mean * from_mean / fitted.xx : 0.0);
    line.largest_ns = std::max(
        line.largest_ns, std::fabs(y(each) - fitted.at(x(each))) / std::max(1.0 - weight, 1e-9));
  }
  return line;
}

/// The largest error with which an event is predicted by its two neighbours.
double largest_from_neighbours(const std::vector<ClockReading>& events) {
  double largest_ns = 0.0;
  for (std::size_t i = 1; i + 1 < events.size(); ++i) {
    const ClockMap neighbours({events[i - 1], events[i + 1]});
    largest_ns = std::max(largest_ns, std::fabs(ns(neighbours(events[i].from) - events[i].to)));
  }
  return largest_ns;
}

/// The mean offset, for events that do not determine a rate.
ClockFit mean_offset(const std::vector<ClockReading>& events) {
  Time sum{0};
  const Time first = events.front().to - events.front().from;
  for (const ClockReading& each : events) sum += (each.to - each.from) - first;
  const Time offset = first + sum / static_cast<std::int64_t>(events.size());
  ClockFit fit{.map = ClockMap(offset), .residual = std::nullopt};
  if (events.size() < 2) return fit;
  fit.residual = Time{0};
  for (const ClockReading& each : events) {
    fit.residual = std::max(*fit.residual, std::chrono::abs(each.to - each.from - offset));
  }
  return fit;
}

}  // namespace

ClockMap::ClockMap(const std::vector<ClockReading>& readings) {
  for (const ClockReading& each : readings) {
    if (!knots_.empty() && (each.from <= knots_.back().from || each.to <= knots_.back().to)) {
      continue;
    }
    knots_.push_back(each);
  }
}

Time ClockMap::operator()(Time from) const noexcept {
  if (knots_.empty()) return from;
  if (knots_.size() == 1) return from + (knots_[0].to - knots_[0].from);
  const auto after =
      std::upper_bound(knots_.begin() + 1, knots_.end() - 1, from,
                       [](Time time, const ClockReading& knot) { return time < knot.from; });
  const ClockReading& before = *(after - 1);
  const Time elapsed = from - before.from;
  return before.to + elapsed + rounded(ns(elapsed) * rate_between(before, *after));
}

ClockMap ClockMap::inverse() const {
  ClockMap map;
  for (const ClockReading& each : knots_) map.knots_.push_back({.from = each.to, .to = each.from});
  return map;
}

ClockMap ClockMap::then(const ClockMap& next) const {
  if (next.knots_.empty()) return *this;
  if (knots_.empty()) return next;
  const ClockMap back = inverse();
  std::vector<Time> places;
  for (const ClockReading& each : knots_) places.push_back(each.from);
  for (const ClockReading& each : next.knots_) places.push_back(back(each.from));
  std::sort(places.begin(), places.end());
  std::vector<ClockReading> both;
  for (const Time place : places) both.push_back({.from = place, .to = next((*this)(place))});
  return ClockMap(both);
}

double ClockMap::rate() const noexcept {
  return knots_.size() < 2 ? 0.0 : rate_between(knots_.front(), knots_.back());
}

double ClockMap::largest_rate() const noexcept {
  double largest = 0.0;
  for (std::size_t i = 1; i < knots_.size(); ++i) {
    largest = std::max(largest, std::fabs(rate_between(knots_[i - 1], knots_[i])));
  }
  return largest;
}

ClockFit fit_clocks(const std::vector<ClockReading>& events, Time first, Time last) {
  const ClockReading& begin = events.front();
  const ClockReading& end = events.back();
  const Line line = events.size() < 2 ? Line{} : line_through(events);
  if (events.size() < 2 || end.from <= begin.from ||
      std::fabs(line.fitted.slope()) > kLargestRate) {
    return mean_offset(events);
  }
  const double span_ns = ns(end.from - begin.from);
  // Two events fix a line and leave nothing to check it.
  double largest_ns = events.size() > 2 ? line.largest_ns : 0.0;
  const auto on_line = [&](const ClockReading& event) {
    return begin.to + (event.from - begin.from) +
           rounded(line.fitted.at(ns(event.from - begin.from)));
  };
  ClockFit fit{.map = ClockMap({{begin.from, on_line(begin)}, {end.from, on_line(end)}}),
               .residual = std::nullopt};
  Time widest{0};
  for (std::size_t i = 1; i < events.size(); ++i) {
    widest = std::max(widest, events[i].from - events[i - 1].from);
  }
  const ClockMap pieces(events);
  if (events.size() > 2 && pieces.largest_rate() < kLargestRate) {
    if (const double error_ns = largest_from_neighbours(events); error_ns < largest_ns) {
      largest_ns = error_ns;
      fit.map = pieces;
    }
  }
  const double beyond_ns = ns(std::max({Time{0}, begin.from - first, last - end.from}));
  fit.residual =
      rounded(largest_ns * (1.0 + beyond_ns / span_ns) + kWander * (ns(widest) / 2 + beyond_ns));
  return fit;
}

}  // namespace merkel
