#include "tools/studies/score/press_trace.hpp"

#include <algorithm>
#include <array>

#include "core/units.hpp"
#include "drivers/files/trace_file.hpp"

namespace merkel {

Expected<PressTrace, SetupError> PressTrace::read(const std::string& path) {
  auto reader = TraceReader::open(path);
  if (!reader) return Unexpected<SetupError>(reader.error());
  if ((reader->channels() & (ProbeSample::kForce | ProbeSample::kDepth)) == 0U) {
    return bad_input(path + " has neither a column force_N nor depth_mm: add the recorded one");
  }
  PressTrace trace;
  const bool force = (reader->channels() & ProbeSample::kForce) != 0U;
  const bool positioned = (reader->channels() & (ProbeSample::kX | ProbeSample::kY)) != 0U;
  trace.control_ = force ? Indenter::Control::kForce : Indenter::Control::kDepth;
  std::array<ProbeSample, 256> samples;
  std::chrono::nanoseconds first{0};
  for (;;) {
    const auto count = reader->read(samples);
    if (!count) return Unexpected<SetupError>(count.error());
    if (*count == 0) break;
    for (std::size_t i = 0; i < *count; ++i) {
      const ProbeSample& sample = samples[i];
      if (trace.time_s_.empty()) {
        first = sample.time;
        trace.begin_s_ = units::s_from(sample.time);
      }
      trace.time_s_.push_back(units::s_from(sample.time - first));
      trace.level_.push_back(force ? sample.force_mN : sample.depth_mm);
      if (!positioned) continue;
      trace.x_mm_.push_back(sample.x_mm);
      trace.y_mm_.push_back(sample.y_mm);
    }
  }
  if (trace.time_s_.size() < 2) return bad_input(path + ": a press needs at least two samples");
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
  const double largest = *std::max_element(level_.begin(), level_.end());
  std::vector<Phase> phases;
  if (!(largest > 0.0)) return phases;
  const auto first_above = [&](double share) {
    std::size_t i = 0;
    while (level_[i] < share * largest) ++i;
    return time_s_[i];
  };
  const auto last_above = [&](double share) {
    std::size_t i = level_.size() - 1;
    while (level_[i] < share * largest) --i;
    return time_s_[i];
  };
  const auto add = [&](const char* name, double begin, double end) {
    if (end - begin >= 0.01) phases.push_back({.name = name, .begin_s = begin, .end_s = end});
  };
  add("ramp", first_above(0.01), first_above(0.95));
  add("hold", first_above(0.95), last_above(0.95));
  add("release", last_above(0.95), last_above(0.01));
  return phases;
}

}  // namespace merkel
