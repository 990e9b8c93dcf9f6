#include "core/encoding/charge_window.hpp"

#include <chrono>
#include <limits>

#include <gtest/gtest.h>

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr double kNoLimit = std::numeric_limits<double>::infinity();

TEST(ChargeWindow, ForgetsWhatCameBeforeAReset) {
  ChargeWindow window(64.0, milliseconds{1});
  const auto taken = [&](int start_ms) {
    int pulses = 0;
    for (int k = 0; k < 10; ++k) {
      pulses += window.takes(milliseconds{start_ms + 10 * k}, 80.0, microseconds{200}) ? 1 : 0;
    }
    return pulses;
  };
  EXPECT_EQ(taken(0), 4);
  window.reset();
  EXPECT_EQ(taken(1500), 4);
}

TEST(ChargeWindow, ForgetsItsOnlyPulseAfterASecond) {
  ChargeWindow window(16.0, milliseconds{1});
  EXPECT_TRUE(window.takes(milliseconds{0}, 80.0, microseconds{200}));
  EXPECT_FALSE(window.takes(milliseconds{999}, 80.0, microseconds{200}));
  EXPECT_TRUE(window.takes(milliseconds{1000}, 80.0, microseconds{200}));
}

TEST(ChargeWindow, ForgetsEachPulseWithItsOwnCharge) {
  ChargeWindow window(24.0, milliseconds{1});
  const auto takes = [&](int ms, double amplitude_uA) {
    return window.takes(milliseconds{ms}, amplitude_uA, microseconds{200});
  };
  EXPECT_TRUE(takes(0, 80.0));  // 16 nC
  EXPECT_TRUE(takes(500, 40.0));
  EXPECT_FALSE(takes(600, 40.0));
  EXPECT_TRUE(takes(1000, 80.0));
  EXPECT_FALSE(takes(1500, 80.0));
  EXPECT_TRUE(takes(1500, 40.0));
}

TEST(ChargeWindow, RoundsEachPulseUp) {
  ChargeWindow window(2e-6, milliseconds{1});  // 2 fC
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(window.takes(milliseconds{k}, 0.001, nanoseconds{500}), k < 2);  // half a fC
  }
}

TEST(ChargeWindow, HasRoomForTheShortestDistance) {
  ChargeWindow window(kNoLimit, milliseconds{1});
  for (int k = 0; k < 1002; ++k) {
    ASSERT_TRUE(window.takes(k * microseconds{500}, 80.0, microseconds{200}));
  }
  EXPECT_FALSE(window.takes(milliseconds{501}, 80.0, microseconds{200}));
  EXPECT_TRUE(window.takes(milliseconds{1000}, 80.0, microseconds{200}));
}

}  // namespace
}  // namespace merkel
