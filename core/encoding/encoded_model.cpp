#include "core/encoding/encoded_model.hpp"

namespace merkel {
namespace {

std::vector<std::optional<EncodedModel::Point>> places_of_afferents(const TactilePatch& patch) {
  struct Sum {
    double x_mm = 0.0;
    double y_mm = 0.0;
    double receptors = 0.0;
  };
  std::vector<Sum> sums(patch.neurons());
  for (const Receptor& receptor : patch.drive().receptors()) {
    Sum& sum = sums[receptor.neuron - 1];
    sum.x_mm += receptor.x_mm;
    sum.y_mm += receptor.y_mm;
    sum.receptors += 1.0;
  }
  std::vector<std::optional<EncodedModel::Point>> places;
  for (const Sum& sum : sums) {
    places.push_back(sum.receptors > 0.0
                         ? std::optional(EncodedModel::Point{.x_mm = sum.x_mm / sum.receptors,
                                                             .y_mm = sum.y_mm / sum.receptors})
                         : std::nullopt);
  }
  return places;
}

}  // namespace

EncodedModel encoded_model(const TactileModel& model) {
  const std::chrono::nanoseconds tick = model.parameters().tick;
  EncodedModel encoded{.tick = tick,
                       .most_spikes = static_cast<std::size_t>(tick / model.parameters().step) + 1,
                       .patches = {},
                       .patch_of_probe = {}};
  for (std::size_t i = 0; i < model.patches().size(); ++i) {
    encoded.patches.push_back({.area = model.parameters().patches[i].patch,
                               .afferents = places_of_afferents(model.patches()[i])});
  }
  for (const Indenter& indenter : model.parameters().indenters) {
    encoded.patch_of_probe.push_back(indenter.patch);
  }
  return encoded;
}

}  // namespace merkel
