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

// A device that is read without its host's clock, such as a simulator, may be reset, or print a
// wrong time.
TEST(ReadingTimes, UnmappedOnesGoOnWhereTheClockGoesBack) {
  ReadingTimes times(ReadingTimes::Rule::kUnmapped);
  std::vector<DeviceReading> batch(300);
  for (std::size_t k = 0; k < batch.size(); ++k) {
    batch[k].device_time = seconds{5} + milliseconds{k % 200};
    batch[k].rebooted = k == 200;
  }
  *batch[50].device_time += seconds{100};
  batch[60].device_time.reset();
  batch[60].wrong_time = true;
  const auto all = times.of(batch);
  ASSERT_EQ(all.size(), batch.size());
  for (std::size_t k = 0; k < all.size(); ++k) EXPECT_EQ(all[k], seconds{5} + milliseconds{k}) << k;
  const auto notices = times.take_notices();
  ASSERT_EQ(notices.size(), 2U);
  EXPECT_NE(notices[0].find("follow one step after those before"), std::string::npos);
  EXPECT_NE(notices[1].find("its clock went back by 0.199 s"), std::string::npos) << notices[1];
  DeviceCounts counts;
  times.describe(counts);
  EXPECT_EQ(counts.clock_outliers, 2U);
  EXPECT_EQ(counts.clock_anchors, 1U);
  EXPECT_EQ(times.of_edge(seconds{5} + milliseconds{99}, {}), seconds{5} + milliseconds{299});
}

// A wrong answer must not put the first samples seconds into the past: the run would begin there.
TEST(ReadingTimes, WrongAnswersOfTheClockAreNotUsed) {
  for (const seconds wrong : {seconds{3}, seconds{-3}, seconds{1800}, seconds{0}}) {
    ReadingTimes times(ReadingTimes::Rule::kMapped);
    times.set_wrap(microseconds{std::int64_t{1} << 32U});
    const auto device_time = [](nanoseconds host) { return host - seconds{900}; };
    for (int k = 0; k < 8; ++k) {
      const nanoseconds sent = seconds{1000} + milliseconds{3 * k};
      const ClockExchange answer = {
          .sent = sent,
          .received = sent + microseconds{400},
          .device_received = device_time(sent + microseconds{200}) + wrong,
          .device_sent = device_time(sent + microseconds{200}) + wrong};
      times.observe({&answer, 1});
    }
    nanoseconds before{0};
    for (int k = 0; k < 3000; ++k) {
      DeviceReading reading;
      const nanoseconds measured = seconds{1001} + milliseconds{k};
      reading.arrival = measured + microseconds{200};
      reading.device_time = device_time(measured);
      const nanoseconds time = times.of({&reading, 1}).front();
      ASSERT_LT(std::chrono::abs(time - measured), milliseconds{2}) << wrong.count() << " " << k;
      ASSERT_GT(time, before);
      before = time;
    }
    EXPECT_EQ(times.take_notices().size(), wrong == seconds{0} ? 0U : 1U) << wrong.count();
  }
}

}  // namespace
}  // namespace merkel
