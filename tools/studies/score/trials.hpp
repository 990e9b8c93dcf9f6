#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/contact/tip_contact.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/scene/tactile_model.hpp"
#include "tools/studies/score/recordings.hpp"

namespace merkel {

/// Presses one afferent again and again, as in an experiment: the trials are afferents in the same
/// place, which differ in their noise alone.
class Trials {
 public:
  /// \param scene  whose skin, afferents and neurons are used; its probes are not
  /// \param stimulus  for whose tip and frequency the model is made
  [[nodiscard]] static Expected<Trials, ParameterError> create(
      const TactileModel::Parameters& scene, const Stimulus& stimulus, std::size_t trials);

  /// Spike times of every trial, s from the touch.
  [[nodiscard]] std::vector<std::vector<double>> run(const Stimulus& stimulus);

  /// The mean energy density in the first trial's receptive field at the end of every tick, kPa, of
  /// a scene whose neurons it drives.
  [[nodiscard]] std::vector<double> energies_kPa(const Stimulus& stimulus);
  [[nodiscard]] std::chrono::nanoseconds tick() const { return model_.parameters().tick; }
  [[nodiscard]] std::chrono::nanoseconds step() const { return model_.parameters().step; }

  /// Whether create() would make the same model for another stimulus.
  [[nodiscard]] bool fits(const Stimulus& stimulus) const;

 private:
  /// Runs the stimulus; \param after_tick  told each tick's spikes
  template <class AfterTick>
  void press(const Stimulus& stimulus, AfterTick after_tick);
  Trials(TactileModel model, const Stimulus& stimulus);
  TactileModel model_;
  Stimulus stimulus_;
  /// By depth, to find the forces of a pin that goes beyond a plate; empty without a plate.
  std::optional<TipContact> pin_, plate_;
};

/// What a stimulus asks for: the rate in its window, Hz, or the decline over its hold; the mean of
/// all trials and, of rates, their standard deviation in impulses.
struct Answer {
  double value = 0.0;
  double count_sd = 0.0;
};
[[nodiscard]] Answer answer_of(const Stimulus& stimulus,
                               const std::vector<std::vector<double>>& trials);

}  // namespace merkel
