#include "tools/run/session_alignment.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include <fmt/core.h>

#include "core/parameters/nearest_name.hpp"
#include "core/units.hpp"
#include "drivers/parsed_number.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;
using Alignment = MergedSessions::Alignment;

/// By which a host's clock may run away from UTC: the tolerance of Linux (adjtimex(2), MAXFREQ).
constexpr double kUtcDrift = 500e-6;
/// A clock was set, not steered.
constexpr double kClockSet = 1e-2;

/// Of its UTC or, in a recording of LabRecorder, of the recorder's clock.
std::optional<nanoseconds> clock_error_of(const SessionReader& session) {
  const std::string text =
      session.fact(session.fact("recorder").empty() ? "utc_error_ns" : "clock_error_ns");
  const auto value = parsed_number<std::int64_t>(text);
  if (!value || *value < 0) return std::nullopt;
  return nanoseconds{*value};
}

/// How far the times of a session may be from its UTC, apart from the error of its UTC.
nanoseconds drift_of(const SessionClock& clock) {
  const nanoseconds beyond = std::max(
      {nanoseconds{0}, clock.utc.front().from - clock.first, clock.last - clock.utc.back().from});
  return nanoseconds{static_cast<std::int64_t>(kUtcDrift * static_cast<double>(beyond.count()))};
}

std::string labels_of(const SessionClock& clock) {
  const std::string list = listed(clock.marks, [](const auto& mark) { return mark.first; });
  return list.empty() ? "it has no marks" : "its marks are " + list;
}

Expected<void, SetupError> has_mark(const SessionClock& session, const std::string& label) {
  if (session.marks.contains(label)) return {};
  return bad_input(session.path + " has no mark \"" + label + "\": " + labels_of(session));
}

/// The wanted sync line of a session, or its only one.
Expected<std::uint32_t, SetupError> sync_line_of(const SessionClock& session,
                                                 std::optional<std::uint32_t> wanted) {
  if (session.rises.empty()) {
    return bad_input(
        session.path +
        " has no pulses of a sync line: connect one and name its column sync, or align "
        "by marks");
  }
  if (wanted && session.rises.contains(*wanted)) return *wanted;
  if (!wanted && session.rises.size() == 1) return session.rises.begin()->first;
  const std::string known =
      listed(session.rises, [](const auto& line) { return std::to_string(line.first); });
  return bad_input(session.path + " has the sync lines " + known + ": choose one with --line");
}

Expected<Alignment, SetupError> by_pulses(const SessionClock& first, const SessionClock& other,
                                          ClockMap& clock) {
  const auto line = sync_line_of(first, std::nullopt);
  if (!line) return Unexpected<SetupError>(line.error());
  const auto aligned = align_pulses(other, {}, first.rises.at(*line), first.path);
  if (!aligned) return Unexpected<SetupError>(aligned.error());
  clock = aligned->fit.map;
  return Alignment{.session = other.path,
                   .residual = aligned->fit.residual,
                   .how = fmt::format("{} of {} pulses{}", aligned->match.pairs.size(),
                                      aligned->match.total, aligned->falling ? ", inverted" : "")};
}

Expected<Alignment, SetupError> by_mark(const SessionClock& first, const SessionClock& other,
                                        const std::string& label, ClockMap& clock) {
  for (const SessionClock* const each : {&first, &other}) {
    if (auto known = has_mark(*each, label); !known) return Unexpected<SetupError>(known.error());
  }
  const auto& here = first.marks.at(label);
  const auto& there = other.marks.at(label);
  if (here.size() != there.size()) {
    return bad_input(fmt::format(
        "{} has {} marks \"{}\", but {} has {}: the marks of all sessions must be the same events",
        first.path, here.size(), label, other.path, there.size()));
  }
  std::vector<ClockReading> events;
  for (std::size_t i = 0; i < here.size(); ++i) events.push_back({.from = there[i], .to = here[i]});
  ClockFit fit = fit_clocks(events, other.first, other.last);
  clock = std::move(fit.map);
  return Alignment{.session = other.path,
                   .residual = fit.residual,
                   .how = here.size() == 1 ? "one mark \"" + label + "\""
                                           : fmt::format("{} marks \"{}\"", here.size(), label)};
}

Expected<Alignment, SetupError> by_utc(const SessionClock& first, const SessionClock& other,
                                       ClockMap& clock) {
  for (const SessionClock* const each : {&first, &other}) {
    if (each->utc.empty()) {
      return bad_input(each->path +
                       " does not say when it was recorded: align the sessions by a mark that all "
                       "of them have, --by-mark LABEL");
    }
  }
  Alignment alignment{.session = other.path, .how = "UTC of the hosts"};
  clock = ClockMap(nanoseconds{0});
  if (first.shares_clock(other) && !first.recorder.empty()) {
    alignment.how = "the same recorder";
    alignment.residual =
        first.clock_error.value_or(nanoseconds{0}) + other.clock_error.value_or(nanoseconds{0});
    return alignment;
  }
  if (first.shares_clock(other)) {
    alignment.how = "the same host";
    // Live runs count on the host's clock; recordings from zeros of their own, at a known UTC.
    if (!first.live || !other.live) {
      clock = ClockMap((first.utc.front().from - first.utc.front().to) -
                       (other.utc.front().from - other.utc.front().to));
    }
    alignment.residual = nanoseconds{0};
    return alignment;
  }
  const ClockMap here(first.utc);
  const ClockMap there(other.utc);
  clock = there.then(here.inverse());
  if (std::max(here.largest_rate(), there.largest_rate()) > kClockSet) {
    alignment.how = "UTC of the hosts, of which one was set during its run";
  } else if (first.clock_error && other.clock_error) {
    alignment.residual =
        *first.clock_error + *other.clock_error + drift_of(first) + drift_of(other);
  }
  return alignment;
}

}  // namespace

Expected<SessionClock, SetupError> SessionClock::read(const RecordedSession& session,
                                                      const SessionClock* other) {
  auto reader = session.reader();
  if (!reader) return Unexpected<SetupError>(reader.error());
  SessionClock clock{.path = session.path(),
                     .rig = reader->fact("rig"),
                     .boot = reader->fact("boot_id"),
                     .recorder = reader->fact("recorder"),
                     .start = session.origin().start,
                     .first = session.origin().start,
                     .last = session.origin().start,
                     .clock_error = clock_error_of(*reader)};
  const RunOrigin& origin = session.origin();
  if (origin.utc.count() != 0) clock.utc.push_back({.from = origin.start, .to = origin.utc});
  clock.live = !reader->fact("live").empty();
  if (other != nullptr && clock.shares_clock(*other)) return clock;
  reader->read_only(
      {SessionStream::Id::kTicks, SessionStream::Id::kSamples, SessionStream::Id::kSync});
  std::optional<std::uint32_t> device;
  const auto read = reader->for_each([&](const SessionChunk& chunk) {
    const auto extend = [&](nanoseconds time) {
      clock.first = std::min(clock.first, time);
      clock.last = std::max(clock.last, time);
    };
    if (!chunk.ticks.empty()) extend(chunk.ticks.back().time);
    for (const DeliveredSample& item : chunk.samples) extend(item.sample.time);
    for (const Mark& mark : chunk.marks) clock.marks[mark.label].push_back(mark.time);
    for (const SyncEdge& edge : chunk.edges) {
      if (edge.probe != device.value_or(edge.probe)) continue;
      device = edge.probe;
      (edge.level == 1 ? clock.rises : clock.falls)[edge.line].push_back(edge.time);
    }
  });
  if (!read) return Unexpected<SetupError>(read.error());
  for (auto& [label, times] : clock.marks) std::sort(times.begin(), times.end());
  for (auto* const edges : {&clock.rises, &clock.falls}) {
    for (auto& [line, times] : *edges) {
      std::sort(times.begin(), times.end());
      times.erase(std::unique(times.begin(), times.end()), times.end());
    }
  }
  for (const ClockReading& each : reader->clock_readings()) {
    if (origin.utc.count() != 0 && each.from > origin.start) clock.utc.push_back(each);
  }
  return clock;
}

Expected<PulseAlignment, SetupError> align_pulses(const SessionClock& session,
                                                  const PulseChoice& choice,
                                                  std::span<const nanoseconds> pulses,
                                                  const std::string& name) {
  std::vector<nanoseconds> own;
  std::vector<nanoseconds> falls;
  if (!choice.mark.empty()) {
    if (auto known = has_mark(session, choice.mark); !known) {
      return Unexpected<SetupError>(known.error());
    }
    own = session.marks.at(choice.mark);
  } else {
    const auto line = sync_line_of(session, choice.line);
    if (!line) return Unexpected<SetupError>(line.error());
    own = session.rises.at(*line);
    if (session.falls.contains(*line)) falls = session.falls.at(*line);
  }
  PulseAlignment alignment;
  auto match = match_pulses(own, pulses, choice.tolerance);
  // An inverted line has its pulses' begins where the other recorder has their ends.
  if (auto inverted = match_pulses(falls, pulses, choice.tolerance);
      inverted && (!match || match->pairs.size() < inverted->pairs.size() / 2)) {
    match = std::move(inverted);
    alignment.falling = true;
  }
  if (!match) {
    return bad_input("the pulses of " + session.path + " and " + name +
                     " do not match: " + match.error());
  }
  alignment.match = std::move(*match);
  alignment.fit = fit_pulses(alignment.match, session.first, session.last);
  return alignment;
}

Expected<Alignment, SetupError> align(const SessionClock& first, const SessionClock& other,
                                      const MergeSettings& settings, ClockMap& clock) {
  auto alignment = settings.pulses         ? by_pulses(first, other, clock)
                   : settings.mark.empty() ? by_utc(first, other, clock)
                                           : by_mark(first, other, settings.mark, clock);
  if (!alignment) return alignment;
  alignment->offset = clock(other.start) - other.start;
  alignment->rate = clock.rate();
  return alignment;
}

namespace {

double rms_ms(const std::vector<nanoseconds>& residuals) {
  double sum = 0.0;
  for (const nanoseconds each : residuals) sum += std::pow(units::ms_from(each), 2);
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(residuals.size(), 1)));
}

}  // namespace

Json alignment_json(const PulseAlignment& aligned, const SessionClock& session,
                    const std::string& to) {
  const ClockMap& map = aligned.fit.map;
  Json session_ns = Json::array();
  Json to_ns = Json::array();
  const auto add = [&](nanoseconds time) {
    session_ns.push_back(time.count());
    to_ns.push_back(map(time).count());
  };
  for (const ClockReading& each : map.readings()) add(each.from);
  if (map.readings().empty()) add(session.first);
  return {{"to", to},
          {"matched", aligned.match.pairs.size()},
          {"pulses", aligned.match.total},
          {"pulses_to", aligned.match.total_other},
          {"inverted", aligned.falling},
          {"offset_s", units::s_from(map(session.start) - session.start)},
          {"rate_ppm", map.rate() * 1e6},
          {"pieces", map.pieces()},
          {"residual_ms", units::ms_from(aligned.fit.residual.value_or(nanoseconds{0}))},
          {"jitter_rms_ms", rms_ms(aligned.match.residuals)},
          {"session_ns", std::move(session_ns)},
          {"to_ns", std::move(to_ns)}};
}

std::optional<RecordedAlignment> parse_alignment(std::string_view text) {
  constexpr double kLargestTime_ns = 0x1p62;
  Json json = Json::parse(text, nullptr, false);
  const auto is_list = [&](const char* name) {
    return json.contains(name) && json[name].is_array() &&
           std::ranges::all_of(json[name], [](const Json& each) {
             return each.is_number_integer() && std::fabs(each.get<double>()) < kLargestTime_ns;
           });
  };
  if (!json.is_object() || !json.contains("to") || !json["to"].is_string() ||
      !is_list("session_ns") || !is_list("to_ns") || json["session_ns"].empty() ||
      json["session_ns"].size() != json["to_ns"].size()) {
    return std::nullopt;
  }
  RecordedAlignment alignment{.to = json["to"].get<std::string>()};
  for (std::size_t i = 0; i < json["to_ns"].size(); ++i) {
    alignment.points.push_back({.from = nanoseconds{json["session_ns"][i].get<std::int64_t>()},
                                .to = nanoseconds{json["to_ns"][i].get<std::int64_t>()}});
  }
  if (ClockMap(alignment.points).largest_rate() > kClockSet) return std::nullopt;
  alignment.json = std::move(json);
  return alignment;
}

std::vector<RecordedAlignment> recorded_alignments(
    std::span<const std::pair<std::string, std::string>> facts) {
  std::vector<RecordedAlignment> all;
  for (const auto& [name, value] : facts) {
    if (name != kAlignmentFact) continue;
    if (auto alignment = parse_alignment(value)) all.push_back(std::move(*alignment));
  }
  return all;
}

}  // namespace merkel
