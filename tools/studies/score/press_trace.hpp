#pragma once

#include <string>
#include <vector>

#include "core/contact/indenter.hpp"
#include "core/expected.hpp"

namespace merkel {

/// A recorded press from its first sample on: the quantity that drives the contact, over time.
class PressTrace {
 public:
  /// Reads a trace file. If it has both depth and force, force drives. Fails if it has fewer than
  /// two samples.
  [[nodiscard]] static Expected<PressTrace, SetupError> read(const std::string& path);

  [[nodiscard]] Indenter::Control control() const noexcept { return control_; }
  /// Time of the first sample, in the file's time.
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
  /// "ramp" up to 95 % of the largest level, "hold" while above it, "release" down to 1 %; phases
  /// shorter than 10 ms are omitted.
  [[nodiscard]] std::vector<Phase> phases() const;

 private:
  Indenter::Control control_ = Indenter::Control::kDepth;
  double begin_s_ = 0.0;
  std::vector<double> time_s_;  ///< since the first sample
  std::vector<double> level_;
  std::vector<double> x_mm_, y_mm_;  ///< empty if the trace has no position
};

}  // namespace merkel
