#include "core/encoding/simulation_step.hpp"

#include <array>

#include <gtest/gtest.h>

namespace merkel {
namespace {

using State = TickRecord::State;

/// The flags of all spikes of a press of 50 ms by two tips, whose records have these states.
std::uint32_t flags_with(State first, State second) {
  TactileModel::Parameters parameters;
  parameters.indenters = {Indenter{}, Indenter{}};
  auto model = TactileModel::create(parameters);
  EXPECT_TRUE(model);
  SimulationStep step(*model, nullptr);
  std::uint32_t flags = 0;
  std::size_t spikes = 0;
  for (int k = 1; k <= 50; ++k) {
    const ContactInput press{.depth_mm = 1.5, .x_mm = 15.0, .y_mm = 10.0};
    const std::array<TickRecord, 2> records = {
        TickRecord{.time = std::chrono::milliseconds{k}, .contact = press, .state = first},
        TickRecord{.time = std::chrono::milliseconds{k}, .contact = press, .state = second}};
    for (const SpikeEvent& spike : step.step(records).spikes) {
      EXPECT_GT(spike.time, std::chrono::milliseconds{k - 1});
      EXPECT_LE(spike.time, std::chrono::milliseconds{k});
      flags |= spike.flags;
      ++spikes;
    }
  }
  EXPECT_GT(spikes, 0U);
  return flags;
}

TEST(SimulationStep, ASpikeSaysThatTheInputOfAnyProbeWasHeld) {
  EXPECT_EQ(flags_with(State::kFollowing, State::kFollowing) & SpikeEvent::kInputHeld, 0U);
  EXPECT_NE(flags_with(State::kHeld, State::kFollowing) & SpikeEvent::kInputHeld, 0U);
  EXPECT_NE(flags_with(State::kFollowing, State::kHeld) & SpikeEvent::kInputHeld, 0U);
}

}  // namespace
}  // namespace merkel
