#include "core/neurons/connor_stevens/connor_stevens_group.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/neurons/connor_stevens/rate_current_table.hpp"
#include "core/units.hpp"
#include "tests/core/every_simd_target.hpp"
#include "tests/core/neurons/serial_team.hpp"
#include "tools/studies/reference/cvode_connor_stevens.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;

ConnorStevens quiet() { return {.noise = {}}; }

std::vector<double> spike_times(nanoseconds step, double (*current)(double), double end_ms) {
  ConnorStevensGroup neuron({.neuron = quiet(), .step = step}, 1);
  SpikeBuffer spikes(1000);
  for (nanoseconds t{0}; units::ms_from(t) < end_ms; t += step) {
    const double begin = current(units::ms_from(t));
    const double end = current(units::ms_from(t + step));
    neuron.advance({&begin, 1}, {&end, 1}, 1, t, spikes);
  }
  std::vector<double> times;
  for (const SpikeEvent& spike : spikes.events()) times.push_back(units::ms_from(spike.time));
  return times;
}

TEST(ConnorStevensGroup, AgreesWithCvodeAndConvergesWithTheSquareOfTheStep) {
  const auto current = [](double t) {
    return 9.0 + 20.0 * std::sin(0.02 * t) * std::sin(0.02 * t);
  };
  const auto expected = reference::connor_stevens_spikes(current, 400.0);
  ASSERT_GT(expected.size(), 30U);
  const auto error = [&](int step_us) {
    const auto times = spike_times(microseconds{step_us}, current, 400.0);
    EXPECT_EQ(times.size(), expected.size());
    double worst = 0.0;
    for (std::size_t k = 0; k < std::min(times.size(), expected.size()); ++k) {
      worst = std::max(worst, std::fabs(times[k] - expected[k]));
    }
    return worst;
  };
  const double coarse = error(50);
  const double fine = error(25);
  // 0.5 % of each interval, accumulated over more than 30 intervals.
  EXPECT_LT(coarse, 3.0);
  EXPECT_LT(fine, 0.3 * coarse);
  EXPECT_LT(error(5), 0.05);
}

TEST(ConnorStevensGroup, FiresAtTheRatesOfThePublishedTable) {
  const RateCurrentTable table(ConnorStevens{}, microseconds{50});
  ASSERT_TRUE(table.valid());
  const double rates[] = {5, 10, 20, 40, 60, 80, 100, 130, 160, 200, 240};
  const double currents[] = {8.27,  8.52,  9.09,  10.43, 12.02, 13.88,
                             16.02, 19.76, 24.29, 32.1,  42.4};
  for (std::size_t k = 0; k < 11; ++k) {
    EXPECT_NEAR(table.rate_Hz(currents[k]), rates[k], 0.005 * rates[k] + 0.1);
    EXPECT_NEAR(table.current_uA_per_cm2(table.rate_Hz(currents[k])), currents[k], 1e-9);
  }
  EXPECT_NEAR(table.current_uA_per_cm2(0.0), 7.8, 0.03);
  EXPECT_NEAR(table.onset_uA_per_cm2(), 8.13, 0.03);
}

TEST(ConnorStevensGroup, FiftyMicrosecondsAreWithinAThirdOfAPercentOfTwenty) {
  const RateCurrentTable coarse(ConnorStevens{}, microseconds{50});
  const RateCurrentTable fine(ConnorStevens{}, microseconds{20});
  for (const double I : {8.5, 9.5, 12.0, 20.0, 40.0}) {
    EXPECT_NEAR(coarse.rate_Hz(I), fine.rate_Hz(I), fine.rate_Hz(I) / 300.0) << I;
  }
}

struct NoisyRun {
  std::vector<SpikeEvent> spikes;
  std::vector<double> potentials;
  bool operator==(const NoisyRun&) const = default;
};

NoisyRun noisy_run(std::size_t count, int steps_a_call, int steps, WorkerTeam* team = nullptr) {
  ConnorStevensGroup neurons({.step = microseconds{50}}, count);
  std::vector<double> current(count);
  for (std::size_t n = 0; n < count; ++n) current[n] = 7.0 + static_cast<double>(n % 50);
  SpikeBuffer spikes(count * 100);
  for (int done = 0; done < steps; done += steps_a_call) {
    neurons.advance(current, current, steps_a_call, done * microseconds{50}, spikes, team);
  }
  spikes.sort();
  NoisyRun made{.spikes = {spikes.events().begin(), spikes.events().end()}, .potentials = {}};
  for (std::size_t n = 0; n < count; ++n) made.potentials.push_back(neurons.potential_mV(n));
  return made;
}

TEST(ConnorStevensGroup, GivesTheSameBitsOnEveryInstructionSet) {
  const NoisyRun made = on_every_simd_target([] { return noisy_run(53, 20, 6000); });
  EXPECT_GT(made.spikes.size(), 500U);
}

TEST(ConnorStevensGroup, GivesTheSameBitsInChunksOfAnySizeAndOnAnyTeam) {
  const NoisyRun made = noisy_run(53, 1, 4000);
  EXPECT_TRUE(made == noisy_run(53, 20, 4000));
  EXPECT_TRUE(made == noisy_run(53, 500, 4000));
  SerialTeam team(3);
  EXPECT_TRUE(noisy_run(3072, 20, 200) == noisy_run(3072, 20, 200, &team));
  EXPECT_EQ(team.most_parts, 3);
}

TEST(ConnorStevensGroup, RestsUnderItsHoldingCurrent) {
  ConnorStevensGroup neuron(
      {.neuron = quiet(), .step = microseconds{50}, .holding_current_uA_per_cm2 = 7.8}, 1);
  const double V = neuron.potential_mV(0);
  const double I = 7.8;
  SpikeBuffer spikes(4);
  neuron.advance({&I, 1}, {&I, 1}, 20'000, nanoseconds{0}, spikes);
  EXPECT_NEAR(neuron.potential_mV(0), V, 1e-3);
  EXPECT_TRUE(spikes.events().empty());
  EXPECT_GT(V, -68.0);
  EXPECT_EQ(neuron.resting_blocks(), 1U);
}

}  // namespace
}  // namespace merkel
