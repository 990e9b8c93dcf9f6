#include "core/neurons/hodgkin_huxley/hodgkin_huxley_group.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/units.hpp"
#include "tools/studies/reference/cvode_membrane.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

HodgkinHuxleyGroup population(IntegrationMethod method, nanoseconds step, std::size_t neurons = 1,
                              const std::optional<LatticeCoupling>& network = std::nullopt) {
  return HodgkinHuxleyGroup({.method = method, .step = step}, neurons, network);
}

/// Spike times in ms of one neuron under a current that may change with time, step by step.
template <class Current>
std::vector<double> spike_times(HodgkinHuxleyGroup neuron, nanoseconds step, Current current,
                                double end_ms) {
  std::vector<double> times;
  SpikeBuffer spikes(4);
  for (nanoseconds t{0}; units::ms_from(t) < end_ms; t += step) {
    const double begin = current(units::ms_from(t));
    const double end = current(units::ms_from(t + step));
    spikes.clear();
    neuron.advance({&begin, 1}, {&end, 1}, 1, t, spikes);
    for (const SpikeEvent& spike : spikes.events()) times.push_back(units::ms_from(spike.time));
  }
  return times;
}

void expect_times(const std::vector<double>& times,
                  const std::vector<reference::CvodeMembranes::Spike>& expected,
                  double tolerance_ms) {
  ASSERT_EQ(times.size(), expected.size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    EXPECT_NEAR(times[i], expected[i].time_ms, tolerance_ms) << "spike " << i + 1;
  }
}

/// The methods of fourth order, at steps where they are within 0.1 µs of CVODE.
struct FourthOrder {
  IntegrationMethod method;
  nanoseconds step;
};
constexpr FourthOrder kFourthOrder[] = {
    {IntegrationMethod::kRk4, nanoseconds{5000}},
    {IntegrationMethod::kStaggeredMultistep, nanoseconds{5000}}};

TEST(HodgkinHuxleyGroup, FourthOrderMethodsAgreeWithCvodeOnStepsOfCurrent) {
  for (const double I : {4.0, 7.0, 10.0, 20.0, 50.0, 100.0}) {
    reference::CvodeMembranes reference;
    reference.current = [I](int, double) { return I; };
    const auto expected = reference.spikes_until(200.0);
    EXPECT_EQ(expected.size() > 8U, I > 5.0);
    for (const auto& [method, step] : kFourthOrder) {
      expect_times(spike_times(
                       population(method, step), step, [I](double) { return I; }, 200.0),
                   expected, 1e-4);
    }
  }
}

TEST(HodgkinHuxleyGroup, FourthOrderMethodsAgreeWithCvodeOnARampAndHold) {
  const auto ramp = [](double t) {
    return t < 10.0 ? 0.0 : t < 30.0 ? 12.0 * (t - 10.0) / 20.0 : t < 150.0 ? 12.0 : 0.0;
  };
  reference::CvodeMembranes reference;
  reference.current = [&](int, double t) { return ramp(t); };
  reference.corners = {10.0, 30.0, 150.0};
  // The current step at 150 ms falls within an integration step: compare only the spikes before it.
  const auto expected = reference.spikes_until(149.0);
  for (const auto& [method, step] : kFourthOrder) {
    expect_times(spike_times(population(method, step), step, ramp, 149.0), expected, 1e-4);
  }
}

/// Spikes in the last 500 ms of 1500 ms at a constant current, and the highest potential in that
/// time.
struct Sustained {
  int spikes = 0;
  double peak_mV = -100.0;
  double trough_mV = 100.0;
};
Sustained sustained(double I) {
  auto neuron = population(IntegrationMethod::kCrankNicolson, nanoseconds{25'000});
  SpikeBuffer spikes(1000);
  neuron.advance({&I, 1}, {&I, 1}, 40'000, nanoseconds{0}, spikes);
  spikes.clear();
  Sustained result;
  for (int step = 0; step < 20'000; ++step) {
    neuron.advance({&I, 1}, {&I, 1}, 1, nanoseconds{0}, spikes);
    result.peak_mV = std::max(result.peak_mV, neuron.potential_mV(0));
    result.trough_mV = std::min(result.trough_mV, neuron.potential_mV(0));
  }
  result.spikes = static_cast<int>(spikes.events().size());
  return result;
}

TEST(HodgkinHuxleyGroup, FiresInClassIIWithADepolarisationBlock) {
  // There is no steady rate below about 48 Hz: a neuron that fires steadily fires at least this
  // fast.
  for (double I = 4.6; I < 7.0; I += 0.05) {
    const int spikes = sustained(I).spikes;
    EXPECT_TRUE(spikes == 0 || spikes >= 24) << I;
  }
  EXPECT_GT(sustained(61.0).peak_mV, 0.0);
  EXPECT_LT(sustained(65.0).peak_mV, 0.0);
  const Sustained before = sustained(150.0);
  const Sustained after = sustained(160.0);
  EXPECT_GT(before.peak_mV - before.trough_mV, 5.0);
  EXPECT_LT(after.peak_mV - after.trough_mV, 0.5);
}

TEST(HodgkinHuxleyGroup, StepsAndSlowRampsHaveDifferentOnsets) {
  EXPECT_EQ(sustained(4.90).spikes, 0);
  EXPECT_GT(sustained(4.98).spikes, 0);
  // Reached over a second, the same current leaves the membrane silent until about 8.4.
  const auto spikes_after_ramp_to = [](double I) {
    return spike_times(
               population(IntegrationMethod::kCrankNicolson, nanoseconds{25'000}),
               nanoseconds{25'000}, [I](double t) { return I * std::min(1.0, 1e-3 * t); }, 5000.0)
        .size();
  };
  EXPECT_EQ(spikes_after_ramp_to(8.3), 0U);
  EXPECT_GT(spikes_after_ramp_to(8.5), 100U);
}

/// Root mean square of the errors of spike times under 10 µA/cm², ms, against CVODE.
double spike_time_error(IntegrationMethod method, nanoseconds step) {
  static const auto expected = [] {
    reference::CvodeMembranes reference;
    reference.current = [](int, double) { return 10.0; };
    return reference.spikes_until(200.0);
  }();
  const auto times = spike_times(
      population(method, step), step, [](double) { return 10.0; }, 200.0);
  EXPECT_EQ(times.size(), expected.size());
  double sum2 = 0.0;
  for (std::size_t i = 0; i < times.size(); ++i) {
    sum2 += std::pow(times[i] - expected[i].time_ms, 2);
  }
  return std::sqrt(sum2 / static_cast<double>(times.size()));
}

TEST(HodgkinHuxleyGroup, CrankNicolsonConvergesWithTheSquareOfTheStep) {
  const double coarse = spike_time_error(IntegrationMethod::kCrankNicolson, nanoseconds{25'000});
  const double fine = spike_time_error(IntegrationMethod::kCrankNicolson, nanoseconds{12'500});
  EXPECT_LT(coarse, 0.05);
  EXPECT_NEAR(coarse / fine, 4.0, 0.5);
}

TEST(HodgkinHuxleyGroup, MultistepConvergesWithTheFourthPowerOfTheStep) {
  const auto method = IntegrationMethod::kStaggeredMultistep;
  const double coarse = spike_time_error(method, nanoseconds{50'000});
  const double fine = spike_time_error(method, nanoseconds{25'000});
  EXPECT_LT(coarse, 1e-3);
  EXPECT_GT(coarse / fine, 14.0);
  EXPECT_LT(fine, 1e-4);
  // At twice the step, it is still far more accurate than the second-order method.
  EXPECT_LT(10.0 * coarse,
            spike_time_error(IntegrationMethod::kCrankNicolson, nanoseconds{25'000}));
}

TEST(HodgkinHuxleyGroup, StaysAtRestWithoutCurrent) {
  for (const auto method : {IntegrationMethod::kCrankNicolson, IntegrationMethod::kRk4,
                            IntegrationMethod::kStaggeredMultistep}) {
    auto neuron = population(method, nanoseconds{25'000});
    SpikeBuffer spikes(4);
    const double none = 0.0;
    neuron.advance({&none, 1}, {&none, 1}, 40'000, nanoseconds{0}, spikes);
    EXPECT_NEAR(neuron.potential_mV(0), -65.0, 1e-9);
    EXPECT_TRUE(spikes.events().empty());
  }
}

TEST(HodgkinHuxleyGroup, CoupledFourthOrderMethodsAgreeWithCvode) {
  const auto network = LatticeCoupling::create({.gain = 0.1, .seed = 3}, 5, 4);
  ASSERT_TRUE(network);
  std::vector<double> current(20);
  for (std::size_t n = 0; n < 20; ++n) current[n] = 6.0 + 0.7 * static_cast<double>(n);

  reference::CvodeMembranes reference;
  reference.neurons = 20;
  reference.current = [&](int n, double) { return current[static_cast<std::size_t>(n)]; };
  reference.coupling.assign(20, std::vector<double>(20, 0.0));
  for (std::size_t n = 0; n < 20; ++n) {
    for (const auto& [other, g] : {std::pair{n + 1, network->to_next_column()[n]},
                                   std::pair{n + 5, network->to_next_row()[n]}}) {
      if (other < 20) reference.coupling[n][other] = reference.coupling[other][n] = g;
    }
  }
  auto expected = reference.spikes_until(60.0);

  for (const auto& [method, step] : kFourthOrder) {
    auto ours = population(method, step, 20, *network);
    SpikeBuffer spikes(10'000);
    ours.advance(current, current, static_cast<int>(std::chrono::milliseconds{60} / step),
                 nanoseconds{0}, spikes);
    spikes.sort();
    ASSERT_EQ(spikes.events().size(), expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i) {
      EXPECT_EQ(spikes.events()[i].neuron, static_cast<std::uint32_t>(expected[i].neuron + 1));
      EXPECT_NEAR(units::ms_from(spikes.events()[i].time), expected[i].time_ms, 1e-4);
    }
  }
}

TEST(SpikeBuffer, DropsAndCountsSpikesWhenFull) {
  SpikeBuffer spikes(2);
  for (int i = 0; i < 5; ++i) spikes.push({});
  EXPECT_EQ(spikes.events().size(), 2U);
  EXPECT_EQ(spikes.refused(), 3U);
}

}  // namespace
}  // namespace merkel
