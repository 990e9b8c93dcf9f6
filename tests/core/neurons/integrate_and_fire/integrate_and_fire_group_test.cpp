#include "core/neurons/integrate_and_fire/integrate_and_fire_group.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/math/normal_random.hpp"
#include "core/units.hpp"
#include "tests/core/every_simd_target.hpp"
#include "tests/core/neurons/serial_team.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::nanoseconds;

IntegrateAndFire quiet_neuron() { return {.refractory_ms = 4.0, .noise = {}}; }

// Values from a Python prototype of the same equations.
TEST(IntegrateAndFireGroup, ReproducesThePrototype) {
  constexpr nanoseconds kStep = microseconds{500};
  IntegrateAndFireGroup neuron({.neuron = quiet_neuron(), .step = kStep}, 1);
  SpikeBuffer spikes(100);
  // The drive of an afferent with two states of adaptation.
  double x1 = 0.0;
  double x3 = 0.0;
  for (int i = 0; i < 2000; ++i) {
    const double u = 18.1 * 2.20939 * std::min(1.0, (i + 1) * 0.5 / 50.0);
    x1 += (u - x1) * -std::expm1(-0.5 / 8.0);
    x3 += (u - x3) * -std::expm1(-0.5 / 1832.0);
    const double drive = (1.0 + 57.0 + 1.54) * u - 57.0 * x1 - 1.54 * x3;
    neuron.advance({&drive, 1}, {&drive, 1}, 1, i * kStep, spikes);
  }
  ASSERT_EQ(spikes.events().size(), 69U);
  const double expected_ms[] = {7.3276, 14.5451, 21.2855, 27.8212};
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_NEAR(units::ms_from(spikes.events()[k].time), expected_ms[k], 5.1e-5);
  }
  EXPECT_NEAR(units::ms_from(spikes.events().back().time), 996.454, 5.1e-4);
}

TEST(IntegrateAndFireGroup, WithoutDriveItIsSilentAndSkipped) {
  IntegrateAndFireGroup neurons({.neuron = {}, .step = microseconds{500}}, 40);
  std::vector<double> drive(40, 0.0);
  SpikeBuffer spikes(4000);
  neurons.advance(drive, drive, 2000, nanoseconds{0}, spikes);
  EXPECT_TRUE(spikes.events().empty());
  EXPECT_TRUE(neurons.all_resting());
  // A driven neuron keeps only its own block awake.
  drive[20] = 30.0;
  neurons.advance(drive, drive, 2000, nanoseconds{0}, spikes);
  EXPECT_GT(spikes.events().size(), 20U);
  EXPECT_EQ(neurons.resting_blocks(), 2U);
  // Without drive, it decays to rest.
  drive[20] = 0.0;
  spikes.clear();
  neurons.advance(drive, drive, 2000, nanoseconds{0}, spikes);
  EXPECT_FALSE(neurons.all_resting());
  for (int k = 0; k < 8; ++k) neurons.advance(drive, drive, 1000, nanoseconds{0}, spikes);
  EXPECT_TRUE(neurons.all_resting());
  EXPECT_TRUE(spikes.events().empty());
}

TEST(IntegrateAndFireGroup, NoiseGrowsWithTheDrive) {
  // The variance of v after one second of weak drive, far from the threshold: σ²·I/full, minus
  // leak.
  IntegrateAndFire neuron{.tau_ms = 1e6, .floor = -1e6, .noise = {.sigma = 0.8, .seed = 5}};
  neuron.threshold = 1e6;
  for (const double drive_Hz : {0.5, 2.0, 5.0, 20.0}) {
    constexpr std::size_t kNeurons = 4000;
    IntegrateAndFireGroup neurons({.neuron = neuron, .step = microseconds{500}}, kNeurons);
    const std::vector<double> drive(kNeurons, drive_Hz);
    SpikeBuffer spikes(1);
    neurons.advance(drive, drive, 200, nanoseconds{0}, spikes);
    double sum2 = 0.0;
    for (std::size_t n = 0; n < kNeurons; ++n) {
      const double off = neurons.potential(n) - 0.1 * drive_Hz;
      sum2 += off * off;
    }
    EXPECT_NEAR(sum2 / kNeurons, 0.1 * 0.64 * std::min(1.0, drive_Hz / 5.0),
                0.1 * 0.1 * 0.64 * std::min(1.0, drive_Hz / 5.0))
        << drive_Hz;
  }
}

TEST(IntegrateAndFireGroup, ApproachesTheExactSolutionWithTheStep) {
  // v = Iτ(1−e^{−t/τ}) reaches 1 after −τ·ln(1 − 1/(Iτ)); then the refractory period of 4 ms.
  for (const double I : {2.5, 20.0, 120.0, 900.0}) {
    const double interval = 0.004 - 0.5 * std::log(1.0 - 1.0 / (0.5 * I));
    for (const int step_us : {500, 100}) {
      IntegrateAndFireGroup neuron({.neuron = quiet_neuron(), .step = microseconds{step_us}}, 1);
      SpikeBuffer spikes(1000);
      neuron.advance({&I, 1}, {&I, 1}, 4'000'000 / step_us, nanoseconds{0}, spikes);
      ASSERT_GE(spikes.events().size(), 2U) << I;
      const double first = units::s_from(spikes.events()[0].time);
      const double second = units::s_from(spikes.events()[1].time);
      // Euler's method is first order.
      const double relative = 1e-6 * step_us / 0.5 + 1e-9;
      EXPECT_NEAR(first, interval - 0.004, relative * interval) << I << " " << step_us;
      EXPECT_NEAR(second - first, interval, relative * interval + 1e-9) << I << " " << step_us;
    }
  }
}

TEST(IntegrateAndFireGroup, NoiseIsThatOfTheSeedTheNeuronAndTheStep) {
  IntegrateAndFire neuron{.floor = -1e6, .noise = {.sigma = 0.8, .seed = 5, .full_drive_Hz = 0.0}};
  neuron.threshold = 1e6;
  IntegrateAndFireGroup neurons({.neuron = neuron, .step = microseconds{500}}, 37);
  const std::vector<double> none(37, 0.0);
  SpikeBuffer spikes(1);
  neurons.advance(none, none, 1, nanoseconds{0}, spikes);
  for (std::size_t n = 0; n < 37; ++n) {
    EXPECT_EQ(neurons.potential(n), 0.8 * std::sqrt(500e-6) * normal_random(5, n, 0)) << n;
  }
}

struct RunOfNeurons {
  std::vector<SpikeEvent> spikes;
  std::vector<double> potentials;
  bool operator==(const RunOfNeurons&) const = default;
};

/// Half a second of neurons under various drives, in calls of `steps_a_call` steps.
RunOfNeurons noisy_run(std::size_t count, int steps_a_call, WorkerTeam* team = nullptr) {
  IntegrateAndFireGroup neurons({.step = microseconds{500}}, count);
  std::vector<double> drive(count);
  for (std::size_t n = 0; n < count; ++n) drive[n] = static_cast<double>(n % 97);
  SpikeBuffer spikes(count * 130);
  for (int done = 0; done < 1000; done += steps_a_call) {
    neurons.advance(drive, drive, steps_a_call, done * microseconds{500}, spikes, team);
  }
  spikes.sort();
  RunOfNeurons made{.spikes = {spikes.events().begin(), spikes.events().end()}, .potentials = {}};
  for (std::size_t n = 0; n < count; ++n) made.potentials.push_back(neurons.potential(n));
  EXPECT_EQ(spikes.refused(), 0U);
  return made;
}

TEST(IntegrateAndFireGroup, GivesTheSameBitsOnEveryInstructionSet) {
  const RunOfNeurons made = on_every_simd_target([] { return noisy_run(101, 2); });
  EXPECT_GT(made.spikes.size(), 1000U);
}

TEST(IntegrateAndFireGroup, GivesTheSameBitsInChunksOfAnySizeAndOnAnyTeam) {
  const RunOfNeurons made = noisy_run(101, 1);
  EXPECT_TRUE(made == noisy_run(101, 8));
  EXPECT_TRUE(made == noisy_run(101, 125));
  SerialTeam team(3);
  EXPECT_TRUE(noisy_run(5000, 10) == noisy_run(5000, 10, &team));
  EXPECT_EQ(team.most_parts, 3);
}

TEST(IntegrateAndFireGroup, ResetRepeatsTheNoise) {
  IntegrateAndFireGroup neurons({}, 20);
  const std::vector<double> drive(20, 30.0);
  SpikeBuffer first(1000);
  neurons.advance(drive, drive, 2000, nanoseconds{0}, first);
  neurons.reset();
  SpikeBuffer second(1000);
  neurons.advance(drive, drive, 2000, nanoseconds{0}, second);
  EXPECT_TRUE(std::equal(first.events().begin(), first.events().end(), second.events().begin(),
                         second.events().end()));
}

TEST(IntegrateAndFireGroup, FiresAsIrregularlyAsRecordedAfferents) {
  constexpr std::size_t kTrials = 64;
  for (const double rate : {10.0, 20.0, 40.0}) {
    IntegrateAndFireGroup trials({.neuron = {.refractory_ms = 4.0}}, kTrials);
    // The drive compensates for the leak and the refractory period.
    const std::vector<double> drive(kTrials, 0.55 + rate / (1.0 - 0.004 * rate));
    SpikeBuffer spikes(kTrials * 1000);
    trials.advance(drive, drive, 20'000, nanoseconds{0}, spikes);
    std::vector<std::vector<double>> times(kTrials);
    for (const SpikeEvent& spike : spikes.events()) {
      times[spike.neuron - 1].push_back(units::s_from(spike.time));
    }
    double cv = 0.0;
    double mean_count = 0.0;
    double squares = 0.0;
    for (const auto& train : times) {
      double sum = 0.0;
      double sum2 = 0.0;
      for (std::size_t k = 1; k < train.size(); ++k) {
        sum += train[k] - train[k - 1];
        sum2 += std::pow(train[k] - train[k - 1], 2);
      }
      const auto intervals = static_cast<double>(train.size() - 1);
      const double mean = sum / intervals;
      cv += std::sqrt(sum2 / intervals - mean * mean) / mean / kTrials;
      const auto count = static_cast<double>(
          std::count_if(train.begin(), train.end(), [](double t) { return t < 1.0; }));
      mean_count += count / kTrials;
      squares += count * count / kTrials;
    }
    // σ/√I·(1 − refractory period·rate): 0.0975 at 40 Hz.
    EXPECT_GT(cv, 0.095) << rate;
    EXPECT_LT(cv, 0.3) << rate;
    EXPECT_NEAR(mean_count, rate, 0.1 * rate);
    EXPECT_LT(std::sqrt(squares - mean_count * mean_count), 1.0) << rate;
  }
}

TEST(IntegrateAndFire, NamesTheInvalidParameter) {
  EXPECT_EQ((IntegrateAndFire{.tau_ms = 0.0}).check(microseconds{500}).error().key,
            "neuron.tau_ms");
  EXPECT_EQ((IntegrateAndFire{.refractory_ms = 0.1}).check(microseconds{500}).error().key,
            "neuron.refractory_ms");
  EXPECT_EQ((IntegrateAndFire{.noise = {.sigma = -1.0}}).check(microseconds{500}).error().key,
            "neuron.noise");
  EXPECT_TRUE(IntegrateAndFire{}.check(microseconds{500}));
}

}  // namespace
}  // namespace merkel
