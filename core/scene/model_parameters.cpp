#include "core/scene/model_parameters.hpp"

namespace merkel {

AfferentParameters default_afferent(NeuronKind kind) {
  switch (kind) {
    case NeuronKind::kIntegrateAndFire:
      return IntegrateAndFireAfferent{};
    case NeuronKind::kConnorStevens:
      return ConnorStevensAfferent{};
    case NeuronKind::kHodgkinHuxley:
      break;
  }
  return HodgkinHuxleyAfferent{};
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
