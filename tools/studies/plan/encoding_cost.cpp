#include "tools/studies/plan/encoding_cost.hpp"

#include <chrono>
#include <vector>

#include "core/units.hpp"
#include "tools/scene/scene_encoder.hpp"

namespace merkel {

Expected<double, SetupError> encoding_cost_us(const Scene& scene, const Rehearsal& rehearsal) {
  if (scene.encoding.electrodes.empty()) return 0.0;
  auto model = TactileModel::create(scene.model);
  if (!model) return bad_input(scene.sentence(model.error()));
  auto encoder = encoder_of(scene, *model);
  if (!encoder) return Unexpected<SetupError>(encoder.error());
  std::vector<TickRecord> records(model->indenters());
  std::chrono::nanoseconds time{0};
  std::chrono::nanoseconds spent{0};
  for (const Rehearsal::Tick& tick : rehearsal.ticks) {
    const auto spikes = step(*model, tick, time);
    time += scene.model.tick;
    for (std::size_t i = 0; i < records.size(); ++i) {
      records[i] = {
          .time = time, .contact = tick.contacts[i], .probe = static_cast<std::uint32_t>(i)};
    }
    const auto started = std::chrono::steady_clock::now();
    static_cast<void>((*encoder)->step({.records = records,
                                        .presses = model->presses(),
                                        .spikes = spikes,
                                        .resets = model->resets()}));
    spent += std::chrono::steady_clock::now() - started;
  }
  return units::us_from(spent) / static_cast<double>(rehearsal.ticks.size());
}

}  // namespace merkel
