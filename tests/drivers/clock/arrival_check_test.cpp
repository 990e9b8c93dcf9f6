#include "drivers/clock/arrival_check.hpp"

#include <gtest/gtest.h>

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using std::chrono::seconds;
using Arrival = ArrivalCheck::Arrival;

/// A device that sends a frame every millisecond.
class ArrivalCheckTest : public testing::Test {
 protected:
  /// The next frame, whose estimated time lies before its arrival.
  Arrival frame(nanoseconds lateness) {
    arrival_ += milliseconds{1};
    return check_.check(arrival_ - lateness, arrival_, milliseconds{1}, true);
  }
  void good_frames(int count) {
    for (int k = 0; k < count; ++k) ASSERT_EQ(frame(nanoseconds{100'000}), Arrival::kGood) << k;
  }
  /// Frames of one lateness, until the clock is to be anchored anew. \return their number
  int frames_until_anchored(nanoseconds lateness, Arrival before) {
    for (int k = 1; k <= 200; ++k) {
      const Arrival verdict = frame(lateness);
      if (verdict == Arrival::kReanchor) return k;
      EXPECT_EQ(verdict, before) << k;
    }
    return 0;
  }

  ArrivalCheck check_;
  nanoseconds arrival_ = seconds{10};
};

TEST_F(ArrivalCheckTest, ATimeAfterItsArrivalIsAnOutlier) {
  good_frames(300);
  EXPECT_EQ(frame(milliseconds{-4}), Arrival::kOutlier);
  good_frames(5);
  // Within the tolerance, and the millisecond since the last batch.
  EXPECT_EQ(frame(nanoseconds{-900'000}), Arrival::kGood);
}

TEST_F(ArrivalCheckTest, AClockThatRunsBackIsAnOutlier) {
  good_frames(300);
  EXPECT_EQ(frame(milliseconds{2}), Arrival::kGood);
  EXPECT_EQ(frame(milliseconds{5}), Arrival::kOutlier);
  good_frames(1);
}

TEST_F(ArrivalCheckTest, OutliersThatLast60MsMoveTheAnchor) {
  good_frames(300);
  EXPECT_EQ(frames_until_anchored(milliseconds{-50}, Arrival::kOutlier), 61);
}

TEST_F(ArrivalCheckTest, AGoodFrameEndsARunOfOutliers) {
  good_frames(300);
  for (int run = 0; run < 3; ++run) {
    for (int k = 0; k < 50; ++k) ASSERT_EQ(frame(milliseconds{-50}), Arrival::kOutlier);
    good_frames(1);
  }
}

TEST_F(ArrivalCheckTest, TwoOutliersAreTooFewHoweverFarApart) {
  good_frames(300);
  EXPECT_EQ(frame(milliseconds{-250}), Arrival::kOutlier);
  arrival_ += milliseconds{100};
  EXPECT_EQ(frame(milliseconds{-250}), Arrival::kOutlier);
  EXPECT_EQ(frame(milliseconds{-250}), Arrival::kReanchor);
}

TEST_F(ArrivalCheckTest, FramesThatStayLateMoveTheAnchor) {
  good_frames(300);
  // The transport stalls, and the delay remains.
  arrival_ += milliseconds{40};
  EXPECT_EQ(frames_until_anchored(milliseconds{40}, Arrival::kGood), 61);
}

TEST_F(ArrivalCheckTest, ADelayOf25MsIsThatOfATransport) {
  good_frames(300);
  arrival_ += milliseconds{25};
  EXPECT_EQ(frames_until_anchored(milliseconds{25}, Arrival::kGood), 0);
  arrival_ += milliseconds{1};
  EXPECT_EQ(frames_until_anchored(milliseconds{26}, Arrival::kGood), 61);
}

TEST_F(ArrivalCheckTest, ABacklogThatShrinksIsGood) {
  good_frames(300);
  arrival_ += milliseconds{200};
  // It catches up by 0.3 ms in every millisecond.
  for (int k = 0; k < 580; ++k) {
    ASSERT_EQ(frame(milliseconds{200} - k * nanoseconds{300'000}), Arrival::kGood) << k;
  }
}

// The host holds back one frame, then the link all others: the backlog comes at once.
TEST_F(ArrivalCheckTest, AStallBehindALateFrameMovesNoAnchor) {
  good_frames(300);
  arrival_ += milliseconds{100};
  EXPECT_EQ(frame(milliseconds{100}), Arrival::kGood);
  arrival_ += milliseconds{500};
  for (int k = 1; k <= 600; ++k) {
    const nanoseconds measured = arrival_ + milliseconds{k - 600};
    ASSERT_EQ(check_.check(measured, arrival_, milliseconds{1}, true), Arrival::kGood) << k;
  }
}

TEST_F(ArrivalCheckTest, ARestartForgetsTheClock) {
  good_frames(300);
  check_.restart();
  EXPECT_EQ(frame(seconds{-7}), Arrival::kGood);
}

}  // namespace
}  // namespace merkel
