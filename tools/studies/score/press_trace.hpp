#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/contact/indenter.hpp"
#include "core/expected.hpp"
#include "realtime/input/contact_decision.hpp"

namespace merkel {

/// A recorded press from its first sample on: the quantity that drives the contact, over time.
class PressTrace {
 public:
  /// Reads a trace, or the samples of a session's first probe. If it has both depth and force,
  /// force drives. Fails if it has fewer than two samples, or touches with a negative force.
  /// \param contact  of a trace; a session has its own, but for the sign of the force
  [[nodiscard]] static Expected<PressTrace, SetupError> read(const std::string& path,
                                                             ContactDecision::Parameters contact);

  [[nodiscard]] Indenter::Control control() const noexcept { return control_; }
  /// Time of the first sample: in a trace its own time, in a session since the start.
  [[nodiscard]] double begin_s() const noexcept { return begin_s_; }
  [[nodiscard]] double duration_s() const noexcept { return time_s_.back(); }

  struct Level {
    double level = 0.0;  ///< mm or mN, depending on the control
    double x_mm = 0.0;
    double y_mm = 0.0;
  };
  /// The level at a time since the first sample, interpolated linearly.
  [[nodiscard]] Level at(double time_s) const;
  [[nodiscard]] bool positioned() const noexcept { return !x_mm_.empty(); }

  /// A part of the press.
  struct Phase {
    std::string name;
    double begin_s = 0.0;
    double end_s = 0.0;
  };
  /// "ramp" from the first contact up to 95 % of the largest level, "hold" while above it,
  /// "release" until the last contact; phases shorter than 10 ms are omitted.
  [[nodiscard]] std::vector<Phase> phases() const;

 private:
  Indenter::Control control_ = Indenter::Control::kDepth;
  double begin_s_ = 0.0;
  std::vector<double> time_s_;  ///< since the first sample
  std::vector<double> level_;
  std::optional<double> touched_s_;  ///< the first sample that touches; empty: none does
  double released_s_ = 0.0;          ///< the last one
  std::vector<double> x_mm_, y_mm_;  ///< empty if the trace has no position
};

}  // namespace merkel
