#pragma once

#include <chrono>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/parameters/parameter_error.hpp"
#include "core/scene/tactile_model.hpp"
#include "tools/studies/score/recordings.hpp"

namespace merkel {

/// The model of a scene's afferent at one place, as many times as there are trials.
/// \param stimulus  gives the tip and the tick
[[nodiscard]] TactileModel::Parameters repeated_afferent(const TactileModel::Parameters& scene,
                                                         const Stimulus& stimulus,
                                                         std::size_t trials);

/// Presses one afferent repeatedly, as in an experiment. The trials are afferents at the same
/// position with different noise.
class Trials {
 public:
  /// \param scene  gives skin, afferents and neurons; its probes are not used
  /// \param stimulus  gives the tip and frequency of the model
  [[nodiscard]] static Expected<Trials, ParameterError> create(
      const TactileModel::Parameters& scene, const Stimulus& stimulus, std::size_t trials);

  /// Spike times of every trial, s from the touch.
  [[nodiscard]] std::vector<std::vector<double>> run(const Stimulus& stimulus);

  /// The mean energy density, kPa, in the first trial's receptive field at the end of every tick,
  /// for a scene with neurons driven by energy density.
  [[nodiscard]] std::vector<double> energies_kPa(const Stimulus& stimulus);
  [[nodiscard]] std::chrono::nanoseconds tick() const { return model_.parameters().tick; }
  [[nodiscard]] std::chrono::nanoseconds step() const { return model_.parameters().step; }

  /// True if create() would make the same model for another stimulus.
  [[nodiscard]] bool fits(const Stimulus& stimulus) const;

 private:
  /// Runs the stimulus; \param after_tick  called with each tick's spikes
  template <class AfterTick>
  void press(const Stimulus& stimulus, AfterTick after_tick);
  Trials(TactileModel model, const Stimulus& stimulus)
      : model_(std::move(model)), stimulus_(stimulus) {}
  TactileModel model_;
  Stimulus stimulus_;
};

/// The response to a stimulus: the rate in its window, Hz, or the decline over its hold; mean of
/// all trials and, of rates, their standard deviation in impulses.
struct Answer {
  double value = 0.0;
  double count_sd = 0.0;
};
[[nodiscard]] Answer answer_of(const Stimulus& stimulus,
                               const std::vector<std::vector<double>>& trials);

}  // namespace merkel
