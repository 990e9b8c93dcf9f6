#include "tools/studies/score/press_trace.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <span>

#include "core/units.hpp"
#include "drivers/probes/open_probe.hpp"

namespace merkel {

Expected<PressTrace, SetupError> PressTrace::read(const std::string& path,
                                                  ContactDecision::Parameters contact) {
  auto probe = open_probe("replay:" + path);
  if (!probe) return Unexpected<SetupError>(probe.error());
  const std::uint32_t channels = (*probe)->info().channels;
  if ((channels & (ProbeSample::kForce | ProbeSample::kDepth)) == 0U) {
    return bad_input(path + " has neither a column force_N nor depth_mm: add the recorded one");
  }
  PressTrace trace;
  const RecordedRun run = (*probe)->info().run.value_or(RecordedRun{});
  const bool force = (channels & ProbeSample::kForce) != 0U;
  const bool positioned = (channels & (ProbeSample::kX | ProbeSample::kY)) != 0U;
  contact.control = trace.control_ = force ? Indenter::Control::kForce : Indenter::Control::kDepth;
  const double sign = contact.invert_force ? -1.0 : 1.0;
  ContactDecision decision(contact, true);
  std::array<ProbeSample, 256> samples;
  std::chrono::nanoseconds first{0};
  double touching = 0.0;  // sum of the levels
  for (;;) {
    const auto count = (*probe)->read(samples, std::chrono::milliseconds{0});
    if (!count && count.error() == ProbeError::kEndOfStream) break;
    if (!count) return bad_input((*probe)->error_message());
    for (ProbeSample& sample : std::span(samples).first(*count)) {
      // That of a session was decided when it was recorded.
      if (!is_decided(sample.touch)) decision.decide(sample);
      if (trace.time_s_.empty()) {
        first = sample.time;
        trace.begin_s_ = units::s_from(sample.time - run.zero);
      }
      const double time_s = units::s_from(sample.time - first);
      const double level = force ? sign * sample.force_mN : sample.depth_mm;
      if (touches(sample)) {
        touching += level;
        trace.touched_s_ = trace.touched_s_ ? std::min(*trace.touched_s_, time_s) : time_s;
        trace.released_s_ = time_s;
      }
      trace.time_s_.push_back(time_s);
      trace.level_.push_back(level);
      if (!positioned) continue;
      trace.x_mm_.push_back(sample.x_mm);
      trace.y_mm_.push_back(sample.y_mm);
    }
  }
  if (trace.time_s_.size() < 2) return bad_input(path + ": a press needs at least two samples");
  if (force && touching < 0.0) {
    return bad_input(path + " was recorded with the other sign of force: " +
                     (contact.invert_force ? "remove [probe] invert_force from the scene"
                                           : "set [probe] invert_force = true in the scene"));
  }
  return trace;
}

PressTrace::Level PressTrace::at(double time_s) const {
  const auto after = std::upper_bound(time_s_.begin(), time_s_.end(), time_s);
  const auto right = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(
      after - time_s_.begin(), 1, static_cast<std::ptrdiff_t>(time_s_.size()) - 1));
  const std::size_t left = right - 1;
  const double part =
      std::clamp((time_s - time_s_[left]) / (time_s_[right] - time_s_[left]), 0.0, 1.0);
  const auto between = [&](const std::vector<double>& values) {
    return values[left] + part * (values[right] - values[left]);
  };
  Level level{.level = between(level_)};
  if (positioned()) {
    level.x_mm = between(x_mm_);
    level.y_mm = between(y_mm_);
  }
  return level;
}

std::vector<PressTrace::Phase> PressTrace::phases() const {
  std::vector<Phase> phases;
  if (!touched_s_) return phases;
  const double high = 0.95 * *std::max_element(level_.begin(), level_.end());
  const auto is_high = [high](double level) { return level >= high; };
  const auto rose = std::find_if(level_.begin(), level_.end(), is_high) - level_.begin();
  const auto fell = level_.rend() - std::find_if(level_.rbegin(), level_.rend(), is_high) - 1;
  const double rose_s = time_s_[static_cast<std::size_t>(rose)];
  const double fell_s = time_s_[static_cast<std::size_t>(fell)];
  const auto add = [&](const char* name, double begin, double end) {
    if (end - begin >= 0.01) phases.push_back({.name = name, .begin_s = begin, .end_s = end});
  };
  add("ramp", *touched_s_, rose_s);
  add("hold", rose_s, fell_s);
  add("release", fell_s, released_s_);
  return phases;
}

}  // namespace merkel
