#include "realtime/input/contact_decision.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <iterator>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/units.hpp"

namespace merkel {
namespace {

using Parameters = ContactDecision::Parameters;
using OfTime = std::function<double(double)>;

constexpr Parameters kGauge{.contact_N = 0.012};
constexpr double kNoise_mN = 2.0;

/// Numbers of a normal distribution, by a generator of their own.
class Noise {
 public:
  double next() {
    double sum = -6.0;
    for (int i = 0; i < 12; ++i) {
      state_ = state_ * 6364136223846793005U + 1442695040888963407U;
      sum += static_cast<double>(state_ >> 11U) * 0x1p-53;
    }
    return kNoise_mN * sum;
  }

 private:
  std::uint64_t state_ = 7;
};

/// A probe whose sensor drifts, and what was decided of its samples.
struct Recording {
  std::vector<ProbeSample> samples;
  std::vector<double> true_mN;
  std::vector<bool> uncertain;
  ContactDecision::Drift drift;

  static Recording of(double seconds, const OfTime& press_mN, const OfTime& drift_mN,
                      const Parameters& parameters = kGauge, double step_s = 1e-3) {
    Recording made;
    ContactDecision decision(parameters, false);
    Noise noise;
    const double sign = parameters.invert_force ? -1.0 : 1.0;
    for (int i = 0; i * step_s < seconds; ++i) {
      const double time_s = i * step_s;
      ProbeSample sample{.time = units::nanoseconds_from_s(time_s),
                         .channels = ProbeSample::kForce};
      made.true_mN.push_back(press_mN(time_s));
      sample.force_mN = sign * (press_mN(time_s) + drift_mN(time_s) + noise.next());
      decision.decide(sample);
      made.samples.push_back(sample);
      made.uncertain.push_back(sample.doubts() == ProbeSample::kZeroUncertain);
    }
    made.drift = decision.drift();
    return made;
  }

  /// The time for which a touch was decided, though nothing touched.
  [[nodiscard]] double phantom_s(double step_s = 1e-3) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (true_mN[i] <= 0.0 && touches(samples[i])) sum += step_s;
    }
    return sum;
  }
  [[nodiscard]] double touched_s(double step_s = 1e-3) const {
    double sum = 0.0;
    for (const ProbeSample& sample : samples) sum += touches(sample) ? step_s : 0.0;
    return sum;
  }
  [[nodiscard]] double uncertain_s(double step_s = 1e-3) const {
    return step_s * static_cast<double>(std::count(uncertain.begin(), uncertain.end(), true));
  }
  [[nodiscard]] double mean_mN(double from_s, double to_s) const {
    double sum = 0.0;
    double count = 0.0;
    for (const ProbeSample& sample : samples) {
      const double time_s = units::s_from(sample.time);
      if (time_s < from_s || time_s >= to_s) continue;
      sum += sample.force_mN;
      count += 1.0;
    }
    return sum / count;
  }
  /// The first sample that touches after a time.
  [[nodiscard]] std::size_t first_touch(double after_s = 0.0) const {
    std::size_t i = 0;
    while (i < samples.size() &&
           (units::s_from(samples[i].time) < after_s || !touches(samples[i]))) {
      ++i;
    }
    return i;
  }
};

double three_presses_mN(double time_s) {
  for (const double begin_s : {10.0, 60.0, 110.0}) {
    if (time_s > begin_s && time_s < begin_s + 1.0) return 300.0;
  }
  return 0.0;
}

double at_rest(double /*time_s*/) { return 0.0; }

OfTime drifting(double per_s) {
  return [per_s](double time_s) { return per_s * time_s; };
}

OfTime held(double from_s, double to_s, double force_mN) {
  return [=](double time_s) { return time_s > from_s && time_s < to_s ? force_mN : 0.0; };
}

TEST(ContactDecisionDrift, IsNoTouchAndLeavesThePresses) {
  for (const double drift_mN : {0.0, 20.0, -20.0, 60.0, -60.0}) {
    const auto made = Recording::of(120.0, three_presses_mN, drifting(drift_mN / 120.0));
    EXPECT_LE(made.phantom_s(), 0.05) << drift_mN;  // the 10 ms after each release
    EXPECT_EQ(made.uncertain_s(), 0.0) << drift_mN;
    for (const double begin_s : {10.0, 60.0, 110.0}) {
      EXPECT_NEAR(made.mean_mN(begin_s + 0.1, begin_s + 0.9), 300.0, 3.0) << drift_mN;
    }
    EXPECT_NEAR(made.drift.change_mN(), drift_mN, 4.0);
  }
}

TEST(ContactDecisionDrift, Of200MilliNewtonsInTenMinutesIsNoTouch) {
  const OfTime presses = [](double time_s) { return std::fmod(time_s, 50.0) > 49.0 ? 300.0 : 0.0; };
  for (const double drift_mN : {200.0, -200.0}) {
    const auto made = Recording::of(600.0, presses, drifting(drift_mN / 600.0));
    EXPECT_LE(made.phantom_s(), 0.011 * 12) << drift_mN;
    EXPECT_NEAR(made.mean_mN(599.1, 599.9), 300.0, 3.0) << drift_mN;
  }
}

TEST(ContactDecisionDrift, IsFollowedBetweenPressesThatLeaveLittleRest) {
  for (const double rest_s : {1.5, 2.0, 3.0}) {
    const OfTime presses = [rest_s](double time_s) {
      return std::fmod(time_s, rest_s + 1.0) > rest_s ? 300.0 : 0.0;
    };
    const auto made = Recording::of(120.0, presses, drifting(0.5));
    EXPECT_LE(made.phantom_s(), 0.011 * 120.0 / (rest_s + 1.0)) << rest_s;
    EXPECT_NEAR(made.samples.back().zero_mN, 60.0, 4.0) << rest_s;
  }
}

TEST(ContactDecisionDrift, OfAnInvertedSensorIsFollowedToo) {
  Parameters inverted = kGauge;
  inverted.invert_force = true;
  const auto made = Recording::of(120.0, three_presses_mN, drifting(0.5), inverted);
  EXPECT_LE(made.phantom_s(), 0.05);
  EXPECT_NEAR(made.mean_mN(60.1, 60.9), -300.0, 3.0);
  EXPECT_NEAR(made.samples.back().zero_mN, -60.0, 4.0);
}

TEST(ContactDecisionHold, OfTenMinutesIsKept) {
  const auto made = Recording::of(640.0, held(10.0, 610.0, 300.0), at_rest, kGauge, 2e-3);
  EXPECT_EQ(made.uncertain_s(2e-3), 0.0);
  EXPECT_NEAR(made.mean_mN(11.0, 12.0), 300.0, 1.0);
  EXPECT_NEAR(made.mean_mN(600.0, 609.0), made.mean_mN(11.0, 12.0), 0.3);
  EXPECT_NEAR(made.touched_s(2e-3), 600.0, 0.05);
}

TEST(ContactDecisionHold, EndsSoonAfterItsReleaseThoughItsZeroHasDrifted) {
  for (const double from_s : {0.0, 10.0}) {  // the drift begins before the hold or with it
    for (const double drift_mN : {200.0, -200.0}) {
      const OfTime drift = [=](double time_s) {
        return drift_mN * std::clamp((time_s - from_s) / (610.0 - from_s), 0.0, 1.0);
      };
      const auto made = Recording::of(640.0, held(10.0, 610.0, 300.0), drift, kGauge, 2e-3);
      EXPECT_LE(made.phantom_s(2e-3), 3.0) << drift_mN;
      EXPECT_NEAR(made.touched_s(2e-3), 600.0, 3.0) << drift_mN;
      EXPECT_EQ(made.samples.back().touch, Touch::kFree);
    }
  }
}

TEST(ContactDecisionPress, AsSlowAsTenMilliNewtonsPerSecondIsFelt) {
  for (const double slope : {10.0, 30.0, 100.0}) {
    const OfTime press = [slope](double time_s) {
      return time_s > 50.0 ? 0.0 : std::clamp((time_s - 10.0) * slope, 0.0, 300.0);
    };
    const auto made = Recording::of(60.0, press, at_rest);
    EXPECT_LE(made.true_mN[made.first_touch()], 15.0) << slope;
    EXPECT_NEAR(made.mean_mN(44.0, 49.0), 300.0, 5.0) << slope;
    EXPECT_EQ(made.uncertain_s(), 0.0) << slope;
  }
}

TEST(ContactDecisionDoubt, ALightPressAfterALongHardOneStaysAndIsUncertain) {
  const OfTime press = [](double time_s) {
    return time_s > 5.0 && time_s < 60.0 ? 500.0 : time_s >= 60.0 && time_s < 110.0 ? 50.0 : 0.0;
  };
  const auto made = Recording::of(120.0, press, at_rest);
  EXPECT_NEAR(made.touched_s(), 105.0, 0.05);
  EXPECT_NEAR(made.uncertain_s(), 50.0, 2.5);
  EXPECT_EQ(made.samples.back().touch, Touch::kFree);
  EXPECT_NEAR(units::s_from(made.drift.uncertain), made.uncertain_s(), 0.01);
}

TEST(ContactDecisionDoubt, EndsWhenThePressGrows) {
  const OfTime press = [](double time_s) {
    return time_s < 5.0 ? 0.0 : time_s > 60.0 && time_s < 80.0 ? 50.0 : 500.0;
  };
  const auto made = Recording::of(100.0, press, at_rest);
  EXPECT_GT(made.uncertain_s(), 15.0);
  EXPECT_TRUE(touches(made.samples.back()));
  EXPECT_FALSE(made.uncertain.back());
}

TEST(ContactDecisionDoubt, AnOffsetFromTheStartIsUncertainUntilItsRelease) {
  const auto made = Recording::of(60.0, held(-1.0, 30.0, 20.0), at_rest);
  EXPECT_NEAR(made.uncertain_s(), 30.0, 0.05);
  EXPECT_NEAR(made.touched_s(), made.uncertain_s(), 1e-6);
}

TEST(ContactDecisionDoubt, ATouchThatRisesAsSlowlyAsDriftIsUncertain) {
  const auto made = Recording::of(120.0, at_rest, drifting(2.0));
  EXPECT_GT(made.phantom_s(), 50.0);
  EXPECT_LE(made.touched_s() - made.uncertain_s(), 0.11);
}

TEST(ContactDecision, TouchesFromTheThresholdUntilTenMillisecondsBelowHalfOfIt) {
  ContactDecision decision({.contact_N = 0.01, .zero = ContactDecision::Zero::kFixed}, false);
  struct Step {
    int ms;
    double force_mN;
    bool touches;
  };
  constexpr Step kSteps[] = {
      {0, 3.0, false},  {1, 9.0, false},  {2, 10.0, true},  {3, 6.0, true},    {4, 4.9, true},
      {12, 4.9, true},  {13, 4.9, false}, {14, 9.0, false}, {15, -3.0, false}, {16, 12.0, true},
      {17, -1.0, true}, {18, 5.0, true},  {27, 1.0, true},  {28, 1.0, false}};
  for (const Step& step : kSteps) {
    ProbeSample sample{.time = std::chrono::milliseconds{step.ms},
                       .force_mN = step.force_mN,
                       .channels = ProbeSample::kForce};
    decision.decide(sample);
    EXPECT_EQ(touches(sample), step.touches) << step.ms << " ms";
    EXPECT_EQ(sample.force_mN, step.force_mN);
  }
}

/// The touches of five taps with noise on both readings.
int touches_of_taps(const Parameters& parameters, std::uint32_t channels) {
  ContactDecision decision(parameters, false);
  Noise noise;
  int count = 0;
  bool before = false;
  for (int i = 0; i < 10'000; ++i) {
    const double level = i % 2000 > 1000 && i % 2000 < 1300 ? 1.0 : 0.0;
    ProbeSample sample{.time = std::chrono::milliseconds{i}, .channels = channels};
    const double force_mN = 300.0 * level + noise.next();
    const double depth_mm = 0.8 * level + 0.002 * noise.next();
    if ((channels & ProbeSample::kForce) != 0U) sample.force_mN = force_mN;
    if ((channels & ProbeSample::kDepth) != 0U) sample.depth_mm = depth_mm;
    decision.decide(sample);
    count += touches(sample) && !before ? 1 : 0;
    before = touches(sample);
  }
  return count;
}

TEST(ContactDecision, FiveNoisyTapsAreFiveTouches) {
  constexpr auto kBoth = std::uint32_t{ProbeSample::kForce} | ProbeSample::kDepth;
  EXPECT_EQ(touches_of_taps(kGauge, ProbeSample::kForce), 5);
  EXPECT_EQ(touches_of_taps({.contact_mm = 0.03}, ProbeSample::kDepth), 5);
  const Parameters by_depth{.contact_mm = 0.03, .control = Indenter::Control::kDepth};
  EXPECT_EQ(touches_of_taps(by_depth, kBoth), 5);
  EXPECT_GT(touches_of_taps({}, ProbeSample::kForce), 1000);
}

TEST(ContactDecision, WithoutAThresholdTheReadingThatDrivesTheModelDecides) {
  constexpr auto kBoth = std::uint32_t{ProbeSample::kForce} | ProbeSample::kDepth;
  for (const auto control : {Indenter::Control::kDepth, Indenter::Control::kForce}) {
    ContactDecision decision({.control = control}, false);
    ProbeSample sample{.depth_mm = -0.1, .force_mN = 5.0, .channels = kBoth};
    decision.decide(sample);
    EXPECT_EQ(touches(sample), control == Indenter::Control::kForce);
  }
}

TEST(ContactDecision, TheThresholdOfDepthIsATouch) {
  for (const auto& [depth_mm, touching] : {std::pair{0.0299, false}, {0.03, true}}) {
    ContactDecision decision({.contact_mm = 0.03}, false);
    ProbeSample sample{.depth_mm = depth_mm, .channels = ProbeSample::kDepth};
    decision.decide(sample);
    EXPECT_EQ(touches(sample), touching) << depth_mm;
  }
}

TEST(ContactDecision, TheZeroOfTheStartIsTheMeanOfHalfASecond) {
  Parameters parameters = kGauge;
  parameters.zero = ContactDecision::Zero::kStart;
  const auto made = Recording::of(
      20.0, held(10.0, 15.0, 300.0), [](double) { return 500.0; }, parameters);
  EXPECT_LE(made.phantom_s(), 0.02);
  EXPECT_NEAR(made.mean_mN(11.0, 14.0), 300.0, 0.5);
  EXPECT_NEAR(made.samples.back().zero_mN, 500.0, 0.5);
}

TEST(ContactDecision, ATareStartsTheZeroAnew) {
  ContactDecision decision(kGauge, false);
  Noise noise;
  ProbeSample sample;
  for (int i = 0; i < 60'000; ++i) {
    sample = {.time = std::chrono::milliseconds{i}, .channels = ProbeSample::kForce};
    sample.force_mN = (i < 50'000 ? 0.001 * i : 0.0) + noise.next();
    if (i == 50'000) sample.touch = Touch::kTared;
    decision.decide(sample);
    ASSERT_FALSE(touches(sample)) << i;
    if (i > 50'000) {
      ASSERT_NEAR(sample.zero_mN, 0.0, 8.0) << i;
    }
  }
  EXPECT_NEAR(sample.zero_mN, 0.0, 1.0);
}

TEST(ContactDecision, ARecordingIsDecidedAsItWas) {
  const auto made = Recording::of(120.0, three_presses_mN, drifting(0.5));
  ContactDecision decision(kGauge, true);
  for (std::size_t i = 0; i < made.samples.size(); ++i) {
    ProbeSample again = made.samples[i];
    decision.decide(again);
    ASSERT_EQ(again.touch, made.samples[i].touch) << i;
    ASSERT_EQ(again.force_mN, made.samples[i].force_mN);
    ASSERT_EQ(again.zero_mN, made.samples[i].zero_mN);
  }
  EXPECT_EQ(decision.drift().change_mN(), made.drift.change_mN());
}

TEST(ContactDecision, ARecordingWithoutZerosIsTrackedOnlyIfTheSceneSaysSo) {
  const auto drift_of = [](const Parameters& parameters) {
    ContactDecision decision(parameters, true);
    for (int i = 0; i < 20'000; ++i) {
      ProbeSample sample{.time = std::chrono::milliseconds{i},
                         .force_mN = 0.0005 * i,
                         .channels = ProbeSample::kForce};
      decision.decide(sample);
    }
    return decision.drift().change_mN();
  };
  EXPECT_EQ(drift_of(kGauge), 0.0);
  Parameters tracked = kGauge;
  tracked.zero = ContactDecision::Zero::kTrack;
  EXPECT_NEAR(drift_of(tracked), 10.0, 0.5);
}

TEST(ContactDecision, ATraceWhoseZeroIsSubtractedIsNotTrackedAgain) {
  const auto made = Recording::of(120.0, three_presses_mN, drifting(0.5));
  Parameters tracked = kGauge;
  tracked.zero = ContactDecision::Zero::kTrack;
  ContactDecision decision(tracked, true);
  for (std::size_t i = 0; i < made.samples.size(); ++i) {
    ProbeSample again = made.samples[i];
    again.touch = Touch::kZeroed;
    decision.decide(again);
    ASSERT_EQ(again.touch, made.samples[i].touch) << i;
    ASSERT_EQ(again.force_mN, made.samples[i].force_mN);
  }
}

TEST(ContactDecisionRest, OfAFixedZeroHasTheRateOfItsDriftAndNoPress) {
  for (const auto zero : {ContactDecision::Zero::kFixed, ContactDecision::Zero::kStart}) {
    for (const bool inverted : {false, true}) {
      const Parameters gauge{.contact_N = 0.012, .zero = zero, .invert_force = inverted};
      const auto rate = [&](double seconds, const OfTime& press_mN, double per_s) {
        const auto made = Recording::of(seconds, press_mN, drifting(per_s), gauge);
        EXPECT_FALSE(made.drift.followed);
        return (inverted ? -1.0 : 1.0) * made.drift.change_mN() /
               units::s_from(made.drift.last - made.drift.first);
      };
      EXPECT_NEAR(rate(60.0, at_rest, 0.15), 0.15, 0.01);
      EXPECT_NEAR(rate(60.0, at_rest, 0.5), 0.5, 0.02);  // touches from 24 s on
      EXPECT_NEAR(rate(60.0, held(15.0, 59.5, 300.0), 0.0), 0.0, 0.05);
      EXPECT_NEAR(rate(400.0, held(15.0, 399.5, 300.0), 0.0), 0.0, 0.05);
      EXPECT_NEAR(rate(60.0, held(15.0, 32.5, 300.0), 0.15), 0.15, 0.01);
    }
  }
}

TEST(ContactDecisionRest, NeedsTwentySecondsForAChange) {
  Parameters fixed = kGauge;
  fixed.zero = ContactDecision::Zero::kFixed;
  const auto made = Recording::of(15.0, at_rest, drifting(0.5), fixed);
  EXPECT_EQ(made.drift.last, made.drift.first);
}

}  // namespace
}  // namespace merkel
