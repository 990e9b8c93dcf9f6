#include "realtime/input/probe_input.hpp"

#include <iterator>
#include <vector>

#include <gtest/gtest.h>

#include "core/units.hpp"
#include "realtime/input/probe_queue.hpp"

namespace merkel {
namespace {

using State = ProbeInput::State;
using std::chrono::nanoseconds;

nanoseconds ms(double time) { return units::nanoseconds_from_ms(time); }

class ProbeInputTest : public testing::Test {
 protected:
  void arrives(double time_ms, double depth_mm) {
    ASSERT_TRUE(channel_.try_push({.time = ms(time_ms),
                                   .arrival = ms(time_ms),
                                   .depth_mm = depth_mm,
                                   .channels = ProbeSample::kDepth}));
  }
  void ends() { channel_.ended = true; }
  void expect(double time_ms, double depth_mm, State state) {
    const auto reading = input_.at(ms(time_ms));
    EXPECT_NEAR(reading.contact.depth_mm, depth_mm, 1e-12) << "at " << time_ms << " ms";
    EXPECT_EQ(reading.state, state) << "at " << time_ms << " ms";
  }

  ProbeQueue channel_{1000};
  ProbeInput input_{channel_, {.stale_after = ms(50), .x_mm = 15.0, .y_mm = 10.0}};
};

TEST_F(ProbeInputTest, InterpolatesBetweenTheSamplesAroundTheTime) {
  arrives(0, 1.0);
  arrives(2, 2.0);
  arrives(4, 0.0);
  expect(0, 1.0, State::kFollowing);
  expect(0.5, 1.25, State::kFollowing);
  expect(2, 2.0, State::kFollowing);
  expect(3, 1.0, State::kFollowing);
  EXPECT_EQ(input_.counts().used, 2U);
  EXPECT_EQ(input_.counts().late, 0U);
}

TEST(ProbeInputTaxels, FollowTheRuleOfTheContact) {
  ProbeQueue channel{100, 2};
  ProbeInput input{channel, {.stale_after = ms(5)}};
  const auto arrives = [&](double time_ms, std::vector<float> taxels) {
    const ProbeSample sample{.time = ms(time_ms),
                             .force_mN = static_cast<double>(taxels[0] + taxels[1]),
                             .channels = ProbeSample::kForce};
    ASSERT_TRUE(channel.try_push(sample, taxels));
  };
  const auto expect = [&](double time_ms, float first, float second, State state) {
    const auto reading = input.at(ms(time_ms));
    EXPECT_EQ(reading.state, state) << time_ms;
    ASSERT_EQ(input.taxels().size(), 2U);
    EXPECT_FLOAT_EQ(input.taxels()[0], first) << time_ms;
    EXPECT_FLOAT_EQ(input.taxels()[1], second) << time_ms;
    EXPECT_NEAR(reading.contact.force_mN, static_cast<double>(first + second), 1e-5);
  };
  arrives(1, {4.0F, 8.0F});
  expect(0, 4.0F, 8.0F, State::kFollowing);
  arrives(3, {8.0F, 0.0F});
  expect(1, 4.0F, 8.0F, State::kFollowing);
  expect(1.5, 5.0F, 6.0F, State::kFollowing);
  expect(4, 8.0F, 0.0F, State::kHeld);
  expect(9, 0.0F, 0.0F, State::kReleased);
  arrives(9.5, {1.0F, 1.0F});
  expect(10, 1.0F, 1.0F, State::kHeld);
}

/// A probe whose ticks use the mean of their samples.
class ProbeInputMean : public testing::Test {
 protected:
  void arrives(double time_ms, double force_mN, std::vector<float> taxels = {0.0F}) {
    ASSERT_TRUE(channel_.try_push(
        {.time = ms(time_ms), .force_mN = force_mN, .channels = ProbeSample::kForce}, taxels));
  }
  void expect(double time_ms, double force_mN, State state) {
    const auto reading = input_.at(ms(time_ms));
    EXPECT_NEAR(reading.contact.force_mN, force_mN, 1e-12) << "at " << time_ms << " ms";
    EXPECT_EQ(reading.state, state) << "at " << time_ms << " ms";
  }

  ProbeQueue channel_{100, 1};
  ProbeInput input_{channel_, {.stale_after = ms(5), .decimate = ProbeInput::Decimate::kMean}};
};

TEST_F(ProbeInputMean, ATickOfSeveralSamplesIsTheirMean) {
  arrives(0, 9.0);
  expect(0, 9.0, State::kFollowing);
  arrives(0.25, 1.0, {10.0F});
  arrives(0.5, 2.0, {20.0F});
  EXPECT_FALSE(input_.ready_for(ms(1)));  // takes what there is, and waits for the rest
  arrives(1, 6.0, {60.0F});
  arrives(1.25, 100.0);
  EXPECT_TRUE(input_.ready_for(ms(1)));
  expect(1, 3.0, State::kFollowing);
  EXPECT_FLOAT_EQ(input_.taxels()[0], 30.0F);
}

TEST_F(ProbeInputMean, FewerThanTwoSamplesInATickAreInterpolated) {
  arrives(0, 1.0);
  arrives(2.5, 3.5);
  arrives(5, 3.5);
  expect(0, 1.0, State::kFollowing);
  expect(2, 3.0, State::kFollowing);
  expect(3, 3.5, State::kFollowing);
}

TEST_F(ProbeInputMean, LateSamplesAndThoseBeforeTheFirstTickAreNotAveraged) {
  arrives(-2, 50.0);
  arrives(-1, 70.0);
  expect(0, 70.0, State::kHeld);
  arrives(-0.5, 1000.0);
  arrives(0.5, 2.0);
  arrives(1.0, 4.0);
  expect(1, 3.0, State::kFollowing);
  EXPECT_EQ(input_.counts().late, 1U);
}

TEST_F(ProbeInputMean, AReleasedProbeHasNoMean) {
  arrives(0, 1.0);
  expect(0, 1.0, State::kFollowing);
  arrives(0.5, 2.0, {5.0F});
  arrives(1.0, 4.0, {5.0F});
  expect(10, 0.0, State::kReleased);
  EXPECT_EQ(input_.taxels()[0], 0.0F);
}

TEST(ProbeInputTaxels, AFullQueueOfRowsRefusesTheSample) {
  ProbeQueue channel{4, 3};
  const std::vector<float> row(3, 1.0F);
  std::size_t taken = 0;
  while (channel.try_push({.time = ms(static_cast<double>(taken))}, row)) ++taken;
  EXPECT_EQ(taken, 4U);
  ProbeInput input{channel, {}};
  static_cast<void>(input.at(ms(1.5)));
  EXPECT_TRUE(channel.try_push({.time = ms(9)}, row));
}

TEST(ProbeInputForce, ASampleBelowTheThresholdDoesNotPress) {
  ProbeQueue channel{100};
  ProbeInput input{channel, {.interpolate = false, .contact = {.contact_N = 0.01}}};
  const double forces_mN[] = {3.0, -3.0, 12.0};
  const double pressing_mN[] = {0.0, -3.0, 12.0};
  for (std::size_t k = 0; k < std::size(forces_mN); ++k) {
    ProbeSample sample{.time = ms(static_cast<double>(k)),
                       .depth_mm = 1.0,
                       .force_mN = forces_mN[k],
                       .channels = ProbeSample::kForce | ProbeSample::kDepth};
    sample.touch = k == 2 ? Touch::kTouching : Touch::kFree;
    ASSERT_TRUE(channel.try_push(sample));
    const ProbeInput::Reading reading = input.at(sample.time);
    EXPECT_EQ(reading.contact.force_mN, pressing_mN[k]) << k;
    EXPECT_EQ(reading.contact.depth_mm, k == 2 ? 1.0 : 0.0) << k;
    EXPECT_EQ(reading.touch, sample.touch) << k;
  }
}

TEST(ProbeInputForce, TheLengthOfItsTouchIsKnown) {
  ProbeQueue channel(8);
  ProbeInput input{channel, {.interpolate = false}};
  const double forces_mN[] = {0.0, 5.0, 5.0, 5.0, 0.0, 5.0};
  const std::int64_t touches_ms[] = {0, 0, 1, 2, 0, 0};
  for (int k = 0; k < 6; ++k) {
    ProbeSample sample{.force_mN = forces_mN[k], .channels = ProbeSample::kForce};
    sample.time = std::chrono::milliseconds{k};
    ASSERT_TRUE(channel.try_push(sample));
    static_cast<void>(input.at(sample.time));
    EXPECT_EQ(channel.touch_ns.load(), 1'000'000 * touches_ms[k]) << k;
  }
}

TEST(ProbeInputForce, MayBeInverted) {
  ProbeQueue channel{10};
  ProbeInput input{channel, {.contact = {.invert_force = true}}};
  ASSERT_TRUE(channel.try_push({.force_mN = -590.0, .channels = ProbeSample::kForce}));
  EXPECT_EQ(input.at(nanoseconds{0}).contact.force_mN, 590.0);
}

TEST_F(ProbeInputTest, BeforeTheFirstSampleTheFirstIsUsed) {
  arrives(10, 0.7);
  expect(0, 0.7, State::kFollowing);
  expect(9, 0.7, State::kFollowing);
}

TEST_F(ProbeInputTest, HoldsWhenNoSampleBeyondTheTimeHasArrived) {
  arrives(0, 1.0);
  expect(1, 1.0, State::kHeld);
  expect(2, 1.0, State::kHeld);
  arrives(2.5, 2.0);
  arrives(4, 3.5);
  expect(3, 2.5, State::kFollowing);
  EXPECT_EQ(input_.counts().held_ticks, 2U);
  EXPECT_EQ(input_.counts().late, 0U);
}

TEST_F(ProbeInputTest, CountsSamplesThatArriveAfterTheirTimeAsLate) {
  arrives(0, 1.0);
  expect(5, 1.0, State::kHeld);
  arrives(3, 2.0);  // its time has already been simulated
  expect(6, 2.0, State::kHeld);
  EXPECT_EQ(input_.counts().late, 1U);
  EXPECT_EQ(input_.counts().used, 1U);
}

TEST_F(ProbeInputTest, ReleasesAfterTooLongASilenceAndResumes) {
  arrives(0, 1.0);
  expect(50, 1.0, State::kHeld);
  expect(51, 0.0, State::kReleased);
  arrives(200, 1.0);
  arrives(201, 1.5);
  expect(52, 0.0, State::kReleased);  // the silence is in the samples: no interpolation across it
  expect(199, 0.0, State::kReleased);
  expect(200, 1.0, State::kFollowing);
  EXPECT_EQ(input_.counts().released_ticks, 3U);
}

TEST_F(ProbeInputTest, AContactSpansAGapThatIsJustWithinTheValidity) {
  arrives(0, 1.0);
  arrives(50, 2.0);
  expect(25, 1.5, State::kFollowing);
  arrives(100.000001, 3.0);
  expect(75, 2.0, State::kHeld);
  expect(100, 2.0, State::kHeld);
}

TEST(ProbeInput, HoldsASampleUpToTheEndOfItsOwnValidity) {
  ProbeQueue channel(1000);
  ProbeInput input(channel, {});
  ASSERT_TRUE(
      channel.try_push({.depth_mm = 1.0, .channels = ProbeSample::kDepth, .valid_for = ms(20)}));
  EXPECT_EQ(input.at(ms(19)).state, State::kHeld);
  const auto last = input.at(ms(20));
  EXPECT_EQ(last.state, State::kHeld);
  EXPECT_EQ(last.contact.depth_mm, 1.0);
  const auto after = input.at(ms(20) + nanoseconds{1});
  EXPECT_EQ(after.state, State::kReleased);
  EXPECT_EQ(after.contact.depth_mm, 0.0);
}

TEST(ProbeInput, HoldsTheLastSampleWithoutValidityFor50MsAfterTheEnd) {
  ProbeQueue channel(1000);
  ProbeInput input(channel, {});
  ASSERT_TRUE(channel.try_push({.depth_mm = 1.0, .channels = ProbeSample::kDepth}));
  // Before the end, it holds without limit.
  const auto before = input.at(ms(10));
  EXPECT_EQ(before.state, State::kHeld);
  channel.ended = true;
  const auto last = input.at(ms(50));
  EXPECT_EQ(last.state, State::kEnded);
  EXPECT_EQ(last.contact.depth_mm, 1.0);
  EXPECT_EQ(input.at(ms(50) + nanoseconds{1}).contact.depth_mm, 0.0);
}

TEST_F(ProbeInputTest, AReplayedSilenceGivesTheLiveResult) {
  arrives(0, 1.0);
  arrives(200, 1.0);
  arrives(201, 1.0);
  expect(1, 1.0, State::kHeld);
  expect(50, 1.0, State::kHeld);
  expect(51, 0.0, State::kReleased);
  expect(200.5, 1.0, State::kFollowing);
}

TEST_F(ProbeInputTest, TheEndOfTheStreamIsNotAMiss) {
  arrives(0, 1.0);
  ends();
  EXPECT_TRUE(input_.ready_for(ms(5)));
  expect(5, 1.0, State::kEnded);
  expect(60, 0.0, State::kEnded);
  EXPECT_TRUE(input_.exhausted());
  EXPECT_EQ(input_.counts().held_ticks, 0U);
  EXPECT_EQ(input_.counts().released_ticks, 0U);
}

TEST_F(ProbeInputTest, IsReadyOnceASampleBeyondTheTimeHasArrived) {
  EXPECT_FALSE(input_.ready_for(ms(1)));
  arrives(0, 1.0);
  EXPECT_FALSE(input_.ready_for(ms(1)));
  arrives(1, 1.0);
  EXPECT_FALSE(input_.ready_for(ms(1)));
  arrives(2, 1.0);
  EXPECT_TRUE(input_.ready_for(ms(1)));
}

TEST_F(ProbeInputTest, IsNotReadyBeforeItBecauseTimesAreNegative) {
  arrives(-1000, 1.0);
  EXPECT_FALSE(input_.ready_for(ms(-900)));
}

TEST_F(ProbeInputTest, PositionsComeFromTheSamplesOrTheScene) {
  ASSERT_TRUE(channel_.try_push(
      {.time = ms(0), .depth_mm = 1.0, .x_mm = 3.0, .channels = ProbeSample::kX}));
  const auto reading = input_.at(ms(0));
  EXPECT_EQ(reading.contact.x_mm, 3.0);
  EXPECT_EQ(reading.contact.y_mm, 10.0);
}

}  // namespace
}  // namespace merkel
