#include "tools/studies/bench/tick_cost.hpp"

#include <vector>

namespace merkel {

Expected<Measurement, ParameterError> tick_cost(const TactileModel::Parameters& scene,
                                                std::span<const ContactInput> presses,
                                                WorkerTeam* team, int runs) {
  auto model = TactileModel::create(scene);
  if (!model) return Unexpected<ParameterError>(model.error());
  model->share_work(team);
  std::vector<ContactInput> now(presses.begin(), presses.end());
  std::chrono::nanoseconds time{0};
  const auto tick = [&] {
    const auto number = time / scene.tick;
    for (std::size_t i = 0; i < now.size(); ++i) {
      // A nanometre more, a nanometre less.
      const double change = number % 2 == 0 ? 1.0 : 1.0 - 1e-6;
      now[i].depth_mm = presses[i].depth_mm * change;
      now[i].force_mN = presses[i].force_mN * change;
    }
    model->step(now, time);
    time += scene.tick;
  };
  // Let whatever is not touched come to rest first.
  for (int k = 0; k < 300; ++k) tick();
  return measure(tick, runs);
}

}  // namespace merkel
