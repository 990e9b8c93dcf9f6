#include "tools/studies/bench/tick_cost.hpp"

#include <vector>

#include "core/scene/afferents.hpp"
#include "core/scene/drive_reach.hpp"
#include "core/scene/tactile_patch.hpp"
#include "realtime/clocks/virtual_clock.hpp"
#include "realtime/output/fanout.hpp"

namespace merkel {
namespace {

/// A press that alternates by a nanometre from tick to tick.
ContactInput wavering(ContactInput press, std::chrono::nanoseconds::rep tick) {
  const double change = tick % 2 == 0 ? 1.0 : 1.0 - 1e-6;
  press.depth_mm *= change;
  press.force_mN *= change;
  return press;
}

}  // namespace

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
    for (std::size_t i = 0; i < now.size(); ++i) now[i] = wavering(presses[i], number);
    model->step(now, time);
    time += scene.tick;
  };
  // First let untouched neurons come to rest.
  for (int k = 0; k < 300; ++k) tick();
  return measure(tick, runs);
}

Expected<StageCosts, ParameterError> stage_costs(const TactileModel::Parameters& scene,
                                                 const ContactInput& press) {
  auto model = TactileModel::create(scene);
  if (!model) return Unexpected<ParameterError>(model.error());
  const TactilePatch& patch = model->patches().front();
  auto afferents = Afferents::create(scene, 0, patch.neurons(), afferent_tables_of(scene));
  if (!afferents) return Unexpected<ParameterError>(afferents.error());
  StageCosts costs;
  const auto us = [](const Measurement& measured) { return 1e6 * measured.median_s; };

  std::chrono::nanoseconds::rep tick = 0;
  const DriveReach reach(TipContact(scene.indenters.front(), scene.skin), scene.skin,
                         scene.transduction, scene.accuracy.cull_tolerance, 1);
  PlacedContact placed;
  const auto make_contact = [&] {
    const Press made = model->press(0, wavering(press, ++tick));
    placed = {.contact = made.contact,
              .x_mm = made.x_mm,
              .y_mm = made.y_mm,
              .reach_mm = reach.radius_mm(made.contact.depth_mm)};
  };
  costs.contact = us(measure(make_contact));

  ReceptorDrive drive(patch.drive().receptors(), patch.neurons(),
                      {.skin = scene.skin,
                       .transduction = scene.transduction,
                       .precision = scene.precision(),
                       .most_contacts = 1});
  PlacedContact contacts[2];
  for (PlacedContact& contact : contacts) {
    make_contact();
    contact = placed;
  }
  const auto find_drive = [&] { static_cast<void>(drive.compute({&contacts[++tick % 2], 1})); };
  costs.drive = us(measure(find_drive));

  const std::vector<double> input(drive.output().begin(), drive.output().end());
  const int steps = static_cast<int>(scene.tick / scene.step);
  SpikeBuffer spikes(10 * patch.neurons());
  const auto take_steps = [&] {
    spikes.clear();
    afferents->advance(input, input, steps, std::chrono::nanoseconds{0}, spikes, nullptr);
    spikes.sort();
  };
  for (int k = 0; k < 300; ++k) take_steps();
  costs.neurons = us(measure(take_steps));

  Fanout fanout;
  ConsumerChannel& channel = fanout.add_consumer(1024);
  channel.add<TickRecord>(1024);
  VirtualClock clock;
  const SpikeEvent spike{.neuron = 1};
  const TickRecord record;
  const auto publish = [&] {
    fanout.publish(std::span(&spike, 1), clock);
    fanout.publish(std::span(&record, 1), clock);
    SpikeEvent taken;
    TickRecord taken_record;
    static_cast<void>(channel.feed<SpikeEvent>().try_pop(taken));
    static_cast<void>(channel.feed<TickRecord>().try_pop(taken_record));
  };
  costs.publish = us(measure(publish));
  return costs;
}

}  // namespace merkel
