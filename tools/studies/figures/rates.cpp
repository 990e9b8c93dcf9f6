#include "tools/studies/figures/rates.hpp"

#include <cmath>

#include "core/scene/tactile_patch.hpp"
#include "core/units.hpp"

namespace merkel {

PressedPatch press_patch(const TactileModel::Parameters& parameters, const ContactInput& press,
                         double duration_s) {
  TactileModel model = *TactileModel::create(parameters);
  PressedPatch patch;
  patch.rate_hz.resize(model.neurons());
  patch.receptors.resize(model.neurons());
  patch.mean_distance_mm.resize(model.neurons());
  for (const Receptor& receptor : model.patches()[0].drive().receptors()) {
    ++patch.receptors[receptor.neuron - 1];
    patch.mean_distance_mm[receptor.neuron - 1] +=
        std::hypot(receptor.x_mm - press.x_mm, receptor.y_mm - press.y_mm);
  }
  const auto tick = parameters.tick;
  const auto end = units::nanoseconds_from_s(duration_s);
  for (std::chrono::nanoseconds time{0}; time < end; time += tick) {
    for (const SpikeEvent& spike : model.step({&press, 1}, time)) {
      ++patch.rate_hz[spike.neuron - 1];
    }
  }
  for (std::size_t n = 0; n < patch.rate_hz.size(); ++n) {
    patch.rate_hz[n] /= duration_s;
    if (patch.receptors[n] > 0) patch.mean_distance_mm[n] /= patch.receptors[n];
  }
  return patch;
}

}  // namespace merkel
