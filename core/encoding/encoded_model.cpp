#include "core/encoding/encoded_model.hpp"

#include <cstddef>

#include "core/scene/tactile_patch.hpp"
namespace merkel {

EncodedModel encoded_model(const TactileModel& model) {
  const std::chrono::nanoseconds tick = model.parameters().tick;
  EncodedModel encoded{.tick = tick,
                       .most_spikes = static_cast<std::size_t>(tick / model.parameters().step) + 1,
                       .patches = {},
                       .patch_of_probe = {}};
  for (std::size_t i = 0; i < model.patches().size(); ++i) {
    const auto sites = model.patches()[i].sites();
    encoded.patches.push_back(
        {.area = model.parameters().patches[i].patch, .afferents = {sites.begin(), sites.end()}});
  }
  for (const Indenter& indenter : model.parameters().indenters) {
    encoded.patch_of_probe.push_back(indenter.patch);
    if (indenter.taxels() != nullptr) encoded.patches[indenter.patch].array = true;
  }
  return encoded;
}

}  // namespace merkel
