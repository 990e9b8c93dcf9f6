#include "drivers/probes/reading_times.hpp"

#include <gtest/gtest.h>

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using std::chrono::seconds;

// clock=device: the device's own intervals, whatever its oscillator is worth.
TEST(ReadingTimes, OfTheDeviceKeepItsIntervalsAndLeaveOutWrongOnes) {
  ReadingTimes times(ReadingTimes::Rule::kDevice);
  std::vector<nanoseconds> all;
  constexpr int kWrong = 700;
  for (int k = 0; k < 2000; ++k) {
    DeviceReading reading;
    reading.arrival = seconds{1000} + milliseconds{k} + microseconds{200 + 37 * (k % 5)};
    reading.device_time =
        seconds{500} + microseconds{1001 * k} + (k == kWrong ? seconds{40} : nanoseconds{0});
    all.push_back(times.of({&reading, 1}).front());
  }
  for (int k = 1; k < 2000; ++k) {
    const auto interval = all[static_cast<std::size_t>(k)] - all[static_cast<std::size_t>(k) - 1];
    if (k == kWrong || k == kWrong + 1) {
      EXPECT_LT(interval, milliseconds{2}) << k;
    } else {
      EXPECT_EQ(interval, microseconds{1001}) << k;
    }
  }
  DeviceCounts counts;
  times.describe(counts);
  EXPECT_TRUE(counts.device_clock);
  EXPECT_EQ(counts.clock_anchors, 0U);
}

}  // namespace
}  // namespace merkel
