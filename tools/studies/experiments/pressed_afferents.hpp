#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "core/contact/indenter.hpp"
#include "core/expected.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/parameters/position.hpp"
#include "core/records/contact_input.hpp"
#include "core/scene/tactile_model.hpp"

namespace merkel {

/// A scene's afferents at chosen places of its finger, pressed by a moving tip or surface. Each
/// place has several afferents with different noise: the trials.
class PressedAfferents {
 public:
  /// \param places  of the receptive fields' centres, from the finger's apex
  [[nodiscard]] static Expected<PressedAfferents, ParameterError> create(
      const TactileModel::Parameters& scene, const Indenter& indenter,
      std::span<const Position> places, std::size_t trials);

  /// Where the tip is at a time, from the finger's apex.
  using Course = std::function<ContactInput(double time_s)>;
  /// Spike times of all trials of each place, s.
  [[nodiscard]] std::vector<std::vector<double>> run(const Course& course, double seconds);
  /// The mean rate of each place, Hz, in a window.
  [[nodiscard]] std::vector<double> rates(const Course& course, double from_s, double until_s);

  [[nodiscard]] std::size_t trials() const noexcept { return trials_; }

 private:
  PressedAfferents(TactileModel model, std::size_t trials)
      : model_(std::move(model)), trials_(trials) {}
  TactileModel model_;
  std::size_t trials_;
};

/// A surface on the finger, deep enough for a press by a plate of this force and the relief.
[[nodiscard]] Indenter surface_for_force(const TactileModel::Parameters& scene, double force_mN,
                                         double relief_mm);
/// A surface pressed to a depth.
[[nodiscard]] Indenter surface_for_depth(double depth_mm, double relief_mm);

}  // namespace merkel
