#include "drivers/probes/taxel_readings.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/text_has.hpp"

namespace merkel {
namespace {

std::vector<ChannelName> channels(std::size_t count, bool force) {
  std::vector<ChannelName> all;
  for (std::size_t i = 0; i < count; ++i) {
    all.push_back({.name = "t" + std::to_string(i + 1) + (force ? "_N" : "_kPa"),
                   .channel = named_channel(i),
                   .column = i + 1,
                   .quantity = force ? Quantity::kForce : Quantity::kPressure});
  }
  return all;
}

class TaxelReadingsTest : public testing::Test {
 protected:
  /// A reading with ± `noise` in turn around `values`.
  bool read(const std::vector<double>& values, double noise = 0.01) {
    DeviceReading reading;
    for (std::size_t i = 0; i < values.size(); ++i) {
      reading.set(named_channel(i), values[i] + ((count_ + i) % 2 == 0 ? noise : -noise));
    }
    ++count_;
    kPa_.assign(values.size(), -1.0);
    return taxels_.take(reading, kPa_, notices_);
  }
  void zero(const std::vector<double>& values) {
    for (int k = 0; k < 19; ++k) EXPECT_FALSE(read(values));
    EXPECT_TRUE(read(values));
  }

  TaxelReadings taxels_{"pad", channels(4, false), {.area_mm2 = 2.0}};
  std::vector<double> kPa_;
  std::vector<std::string> notices_;
  std::size_t count_ = 0;
};

TEST_F(TaxelReadingsTest, TheFirstReadingsAreTheZero) {
  zero({1.0, 2.0, 0.0, -3.0});
  ASSERT_EQ(notices_.size(), 1U);
  EXPECT_TRUE(
      has(notices_[0], "zero and noise of 4 taxels measured over 20 readings: 0.01 kPa rms"))
      << notices_[0];
  EXPECT_EQ(kPa_, (std::vector<double>(4)));
  EXPECT_TRUE(read({11.0, 2.04, 0.0, -13.0}, 0.0));
  EXPECT_NEAR(kPa_[0], 10.0, 1e-5);
  EXPECT_EQ(kPa_[1], 0.0) << "within five times the noise";
  EXPECT_EQ(kPa_[3], 0.0) << "a pull";
  EXPECT_NEAR(taxels_.force_mN(kPa_), 20.0, 1e-5);
}

TEST_F(TaxelReadingsTest, ATareMeasuresTheZeroAgain) {
  zero({0.0, 0.0, 0.0, 0.0});
  taxels_.request_tare();
  zero({200.0, 0.0, 0.0, 0.0});
  EXPECT_EQ(kPa_[0], 0.0);
  EXPECT_TRUE(has(notices_.back(),
                  "their zero has changed by 0.4 N in all: if the array was pressed, lift "
                  "it and tare it: by the live page (--sink 'view:8080?control=1')"))
      << notices_.back();
}

TEST_F(TaxelReadingsTest, DeadTaxelsAreNamed) {
  for (int k = 0; k < 20; ++k) {
    DeviceReading reading;
    for (std::size_t i = 0; i < 4; ++i) {
      const double value = i == 2 ? 7.0 : (i == 3 ? std::nan("") : 0.1 * (k % 3));
      reading.set(named_channel(i), value);
    }
    kPa_.assign(4, 0.0);
    static_cast<void>(taxels_.take(reading, kPa_, notices_));
  }
  ASSERT_EQ(notices_.size(), 3U);
  EXPECT_TRUE(has(notices_[1], "no value from t4_kPa: taken as 0")) << notices_[1];
  EXPECT_TRUE(has(notices_[2], "t3_kPa never changed at rest, unlike the others")) << notices_[2];
}

TEST_F(TaxelReadingsTest, AMissingValueIsBridgedForThreeReadings) {
  zero({0.0, 0.0, 0.0, 0.0});
  notices_.clear();
  ASSERT_TRUE(read({10.0, 20.0, 0.0, 0.0}, 0.0));
  for (int k = 0; k < 3; ++k) {
    ASSERT_TRUE(read({std::nan(""), 20.0, 0.0, 0.0}, 0.0));
    EXPECT_NEAR(kPa_[0], 10.0, 0.01) << k;
  }
  EXPECT_TRUE(notices_.empty());
  ASSERT_TRUE(read({std::nan(""), 20.0, 0.0, 0.0}, 0.0));
  EXPECT_EQ(kPa_[0], 0.0);
  EXPECT_EQ(taxels_.out(), 1U);
  ASSERT_TRUE(read({11.0, 20.0, 0.0, 0.0}, 0.0));
  EXPECT_NEAR(kPa_[0], 11.0, 0.01);
  EXPECT_EQ(taxels_.out(), 0U);
  for (int k = 0; k < 9; ++k) ASSERT_TRUE(read({std::nan(""), 20.0, 0.0, 0.0}, 0.0));
  ASSERT_EQ(notices_.size(), 1U) << "once, however often";
  EXPECT_TRUE(has(notices_[0], "no value from t1_kPa: taken as 0")) << notices_[0];
  EXPECT_EQ(taxels_.lack(), "1 of its 4 taxels had no value (t1_kPa)");
}

TEST_F(TaxelReadingsTest, ATaxelAtTheEndOfItsRangeIsNamedOnce) {
  zero({0.0, 0.0, 0.0, 0.0});
  notices_.clear();
  for (int k = 0; k < 1200; ++k) {
    DeviceReading reading;
    for (std::size_t i = 0; i < 4; ++i)
      reading.set(named_channel(i), i == 1 ? 500.0 : 0.01 * (k % 2));
    static_cast<void>(taxels_.take(reading, kPa_, notices_));
  }
  ASSERT_EQ(notices_.size(), 1U);
  EXPECT_TRUE(has(notices_[0], "t2_kPa stopped changing: at the end of its range")) << notices_[0];
  EXPECT_NEAR(kPa_[1], 500.0, 0.1);
}

/// The taxels of an array whose second taxel drifts by a noise threshold in 40 s, and whose third
/// one is pressed for ten seconds.
std::vector<double> after_drift(bool tracks) {
  TaxelReadings taxels("pad", channels(3, false), {.tracks = tracks});
  std::vector<double> kPa(3);
  std::vector<double> largest(3);
  std::vector<std::string> notices;
  for (int k = 0; k < 60'000; ++k) {
    DeviceReading reading;
    reading.arrival = std::chrono::milliseconds{k};
    const double noise = 0.01 * ((k * 7919) % 5 - 2);
    const double press = k > 30'000 && k < 40'000 ? 30.0 : 0.0;
    reading.set(named_channel(0), noise);
    reading.set(named_channel(1), noise + 0.07 * k / 40'000.0);
    reading.set(named_channel(2), noise + press + 0.07 * k / 40'000.0);
    if (!taxels.take(reading, kPa, notices)) continue;
    for (std::size_t i = 0; i < 3; ++i) largest[i] = std::max(largest[i], kPa[i]);
    EXPECT_FALSE(taxels.uncertain(kPa));
  }
  return largest;
}

TEST(TaxelReadings, TheZeroOfATaxelFollowsItsDrift) {
  const auto followed = after_drift(true);
  EXPECT_EQ(followed[0], 0.0);
  EXPECT_EQ(followed[1], 0.0);
  EXPECT_NEAR(followed[2], 30.0, 0.1);
  EXPECT_GT(after_drift(false)[1], 0.07);
}

TEST(TaxelReadings, ASlowArrayIsZeroedAfterASecond) {
  TaxelReadings taxels("pad", channels(1, false), {});
  std::vector<double> kPa(1);
  std::vector<std::string> notices;
  int waited = 0;
  for (bool used = false; !used; ++waited) {
    DeviceReading reading;
    reading.set(named_channel(0), 1.0);
    reading.arrival = std::chrono::milliseconds{200 * waited};
    used = taxels.take(reading, kPa, notices);
  }
  EXPECT_EQ(waited, 6);
}

TEST(TaxelReadings, ForcesBecomePressures) {
  TaxelReadings taxels("pad", channels(2, true), {.area_mm2 = 0.5});
  std::vector<double> kPa(2);
  std::vector<std::string> notices;
  for (int k = 0; k < 21; ++k) {
    DeviceReading reading;
    reading.set(named_channel(0), k == 20 ? 0.02 : 0.0);
    reading.set(named_channel(1), 0.0);
    static_cast<void>(taxels.take(reading, kPa, notices));
  }
  EXPECT_NEAR(kPa[0], 40.0, 1e-5);  // 20 mN on 0.5 mm²
  EXPECT_NEAR(taxels.force_mN(kPa), 20.0, 1e-5);
}

}  // namespace
}  // namespace merkel
