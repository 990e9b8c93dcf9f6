#include "core/scene/model_parameters.hpp"

namespace merkel {

void set_kind(ModelParameters& model, NeuronKind kind) {
  using std::chrono::microseconds;
  switch (kind) {
    case NeuronKind::kHodgkinHuxley:
      model.afferent = HodgkinHuxleyAfferent{};
      model.step = ModelParameters{}.step;
      break;
    case NeuronKind::kIntegrateAndFire:
      model.afferent = IntegrateAndFireAfferent{};
      model.step = microseconds{500};
      break;
    case NeuronKind::kConnorStevens:
      model.afferent = ConnorStevensAfferent{};
      model.step = microseconds{50};
      break;
  }
}

const NeuronNoise* ModelParameters::noise() const noexcept {
  if (const auto* const integrate = std::get_if<IntegrateAndFireAfferent>(&afferent)) {
    return &integrate->neuron.noise;
  }
  if (const auto* const connor = std::get_if<ConnorStevensAfferent>(&afferent)) {
    return &connor->neuron.noise;
  }
  return nullptr;
}

}  // namespace merkel
