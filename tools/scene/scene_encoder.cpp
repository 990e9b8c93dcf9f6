#include "tools/scene/scene_encoder.hpp"

#include <utility>

namespace merkel {

Expected<std::unique_ptr<StimulationEncoder>, SetupError> encoder_of(const Scene& scene,
                                                                     const TactileModel& model) {
  if (scene.encoding.electrodes.empty()) return nullptr;
  auto encoder = StimulationEncoder::create(scene.encoding, encoded_model(model));
  if (!encoder) return bad_input(scene.sentence(encoder.error()));
  return std::make_unique<StimulationEncoder>(std::move(*encoder));
}

}  // namespace merkel
