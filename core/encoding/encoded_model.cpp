#include "core/encoding/encoded_model.hpp"

namespace merkel {

EncodedModel encoded_model(const TactileModel& model) {
  const std::chrono::nanoseconds tick = model.parameters().tick;
  EncodedModel encoded{.tick = tick,
                       .most_spikes = static_cast<std::size_t>(tick / model.parameters().step) + 1,
                       .patches = {},
                       .patch_of_probe = {}};
  for (const PatchParameters& patch : model.parameters().patches) {
    encoded.patches.push_back(
        {.area = patch.patch, .afferents = layout_of(patch).value_or(PatchLayout{}).afferents});
  }
  for (const Indenter& indenter : model.parameters().indenters) {
    encoded.patch_of_probe.push_back(indenter.patch);
  }
  return encoded;
}

}  // namespace merkel
