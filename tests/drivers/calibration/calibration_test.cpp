#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "core/math/random.hpp"
#include "drivers/calibration/calibration_fit.hpp"
#include "drivers/calibration/probe_calibration.hpp"
#include "drivers/protocols/unit_factors.hpp"
#include "tests/temporary_folder.hpp"

namespace merkel {
namespace {

/// Readings (known + offset) / gain of a cell, with uniform noise of ±`noise`.
CalibrationPoint point(double known, double gain, double zero, double noise, Random& random) {
  CalibrationPoint point{.known = known, .readings = {}};
  for (int k = 0; k < 4000; ++k) {
    point.readings.push_back(known / gain + zero + noise * (2.0 * random.uniform() - 1.0));
  }
  return point;
}

TEST(CalibrationFit, FindsGainZeroSignAndNoise) {
  Random random(4);
  for (const double gain : {2.5, -0.75}) {
    std::vector<CalibrationPoint> points;
    for (const double known : {0.0, 1.0, 2.0, 4.0}) {
      points.push_back(point(known, gain, 0.3, 0.01, random));
    }
    const auto fitted = fit_calibration({.source = DeviceChannel::kForce}, points);
    ASSERT_TRUE(fitted.has_value());
    EXPECT_NEAR(fitted->gain, gain, 1e-3);
    EXPECT_NEAR(fitted->zero, 0.3, 1e-3);
    EXPECT_NEAR(fitted->noise, std::fabs(gain) * 0.01 / std::sqrt(3.0), 2e-4);
    EXPECT_LT(fitted->residual, 1e-3);
  }
}

TEST(CalibrationFit, OnePointIsATareAndKeepsTheGain) {
  Random random(5);
  const std::vector<CalibrationPoint> points = {point(0.0, 1.0, 0.125, 0.0, random)};
  const auto fitted = fit_calibration({.gain = -2.0}, points);
  ASSERT_TRUE(fitted.has_value());
  EXPECT_DOUBLE_EQ(fitted->zero, 0.125);
  EXPECT_DOUBLE_EQ(fitted->gain, -2.0);
}

TEST(CalibrationFit, ABentSensorLeavesAResidual) {
  std::vector<CalibrationPoint> points;
  for (const double known : {0.0, 1.0, 2.0}) {
    points.push_back({known, std::vector<double>(20, known + 0.1 * known * known)});
  }
  EXPECT_NEAR(fit_calibration({}, points)->residual, 0.0390, 1e-3);
}

TEST(ChannelCalibration, APressOfEitherSignIsComparedWithTheKnownPoints) {
  const auto outside = [](std::array<double, 2> range, double force_N) {
    ProbeCalibration calibration;
    calibration.channels[1] = {.range = range};
    return calibration.is_outside({.force_mN = 1e3 * force_N, .channels = ProbeSample::kForce});
  };
  for (const double sign : {1.0, -1.0}) {
    EXPECT_FALSE(outside({0.0, 0.5}, sign * 0.505)) << sign;
    EXPECT_TRUE(outside({0.0, 0.5}, sign * 0.52)) << sign;
    EXPECT_FALSE(outside({-0.5, 0.0}, sign * 0.505)) << sign;
    EXPECT_TRUE(outside({-0.5, 0.0}, sign * 0.52)) << sign;
    EXPECT_TRUE(outside({0.2, 0.5}, 0.1));
    EXPECT_TRUE(outside({-0.5, -0.2}, -0.1));
  }
  EXPECT_FALSE(outside({-2.0, 0.5}, -1.9));
  EXPECT_TRUE(outside({-2.0, 0.5}, -2.1));
  EXPECT_TRUE(outside({-2.0, 0.5}, 0.6));
  // A stage is far above the skin.
  ProbeCalibration depth;
  depth.channels[0] = {.range = {{0.0, 2.0}}};
  EXPECT_FALSE(depth.is_outside({.depth_mm = -20.0, .channels = ProbeSample::kDepth}));
}

TEST(CalibrationFit, UninformativePointsAreRefused) {
  Random random(6);
  const auto sentence = [](std::span<const CalibrationPoint> points) {
    const auto fitted = fit_calibration({}, points);
    EXPECT_FALSE(fitted.has_value());
    return fitted ? "" : fitted.error().sentence;
  };
  const std::vector<CalibrationPoint> same = {{0.0, point(1.0, 1.0, 0.0, 0.1, random).readings},
                                              {1.0, point(1.0, 1.0, 0.0, 0.1, random).readings}};
  EXPECT_NE(sentence(same).find("differ by less"), std::string::npos);
  const std::vector<CalibrationPoint> few = {{0.0, {1.0, 2.0}}};
  EXPECT_NE(sentence(few).find("only 2 readings"), std::string::npos);
  EXPECT_NE(sentence({}).find("at least one"), std::string::npos);
}

TEST(ProbeCalibration, AFileIsReadBackToTheBit) {
  const TemporaryFolder folder;
  ProbeCalibration written{.serial_number = "A \"7\"\\ß", .date = "2026-01-02T03:04:05Z"};
  written.factors = {{"force_N_per_V", 0.17553}, {"taxel_kPa_per_count", -2e-5}};
  written.channels[0] = {.source = DeviceChannel::kZ, .gain = -1.0, .zero = 1.0 / 3.0};
  written.channels[1] = {.source = DeviceChannel::kForceZ,
                         .gain = 1.0000001,
                         .zero = -2.0,
                         .saturation = 40.0,
                         .noise = 1e-5,
                         .residual = 0.25};
  auto read = read_calibration(folder.file("c.toml", calibration_text(written, "made by a test")));
  ASSERT_TRUE(read.has_value()) << read.error().sentence;
  EXPECT_EQ(read->serial_number, written.serial_number);
  EXPECT_EQ(read->date, written.date);
  std::ranges::sort(read->factors);
  EXPECT_EQ(read->factors, written.factors);
  EXPECT_EQ(read->channels[0]->source, DeviceChannel::kZ);
  EXPECT_EQ(read->channels[0]->zero, 1.0 / 3.0);
  EXPECT_FALSE(read->channels[0]->saturation);
  EXPECT_EQ(read->channels[1]->gain, 1.0000001);
  EXPECT_EQ(*read->channels[1]->saturation, 40.0);
  EXPECT_EQ(read->channels[1]->noise, 1e-5);
  EXPECT_EQ(read->channels[1]->residual, 0.25);
  EXPECT_FALSE(read->channels[2]);
}

TEST(ProbeCalibration, BadFilesAreOneSentence) {
  const TemporaryFolder folder;
  for (const auto& [text, sentence] : std::vector<std::pair<std::string, std::string>>{
           {"[force]\ngain = 1.0\n", "force.source is missing"},
           {"[force]\nsource = \"weight\"\n", "must be one of force"},
           {"[force]\nsource = \"force\"\ngain = nan\n", "must be a finite number"},
           {"[force]\nsource = \"force\"\ngain = 0.0\n", "must not be 0"},
           {"[weight]\n", "is unknown"},
           {"date = 3\n", "must be a text"},
           {"force_N_per_V = \"much\"\n", "must be a finite number that is not 0"},
           {"force_mm_per_V = 2.5\n", "write force_N_per_V"},
           {"force_per_V = 2.5\n", "is written like force_N_per_V"},
           {"force_N_per_V = 1\nload_N_per_V = 2\n", "keep one"},
           {"[force\n", "c.toml:1"}}) {
    const auto read = read_calibration(folder.file("c.toml", text));
    ASSERT_FALSE(read.has_value()) << text;
    EXPECT_NE(read.error().sentence.find(sentence), std::string::npos) << read.error().sentence;
  }
}

TEST(UnitFactors, TheNearestKeyIsForAColumn) {
  UnitFactors factors;
  for (const auto& [key, value] :
       std::vector<std::pair<std::string, double>>{{"force_mN_per_V", 175.53},
                                                   {"force_x_N_per_V", 3.0},
                                                   {"position_um_per_mV", 2.5},
                                                   {"pressure_kPa_per_count", 0.5},
                                                   {"pad_Pa_per_count", 10.0}}) {
    ASSERT_EQ(factors.add(key, value), "");
  }
  const auto factor = [&](std::string_view stem, std::string_view unit) {
    const auto found = factors.of(stem, *unit_named(unit));
    return found ? found->factor : 0.0;
  };
  EXPECT_DOUBLE_EQ(factor("force", "V"), 0.17553);
  EXPECT_DOUBLE_EQ(factor("load", "mV"), 0.17553e-3);
  EXPECT_DOUBLE_EQ(factor("force2", "V"), 0.17553);
  EXPECT_DOUBLE_EQ(factor("force_y", "V"), 0.17553);
  EXPECT_DOUBLE_EQ(factor("force_x", "V"), 3.0);
  EXPECT_DOUBLE_EQ(factor("depth", "V"), 2.5);
  EXPECT_DOUBLE_EQ(factor("pad17", "count"), 0.01);
  EXPECT_DOUBLE_EQ(factor("t17", "count"), 0.5);
  EXPECT_EQ(factor("force", "count"), 0.0);  // no force is a pressure
  EXPECT_EQ(factor("forceful", "V"), 0.0);
  EXPECT_EQ(factor("x", "V"), 0.0);
}

TEST(ProbeCalibration, AStagesZIsTheDepthTurnedRound) {
  auto calibration = ProbeCalibration::natural(
      bit_of(DeviceChannel::kX) | bit_of(DeviceChannel::kY) | bit_of(DeviceChannel::kZ));
  EXPECT_EQ(calibration.sample_channels(), ProbeSample::kDepth | ProbeSample::kX | ProbeSample::kY);
  DeviceReading reading;
  reading.set(DeviceChannel::kX, 3.0);
  reading.set(DeviceChannel::kZ, -1.5);
  EXPECT_EQ(calibration.apply(reading).depth_mm, 1.5);
  EXPECT_EQ(calibration.apply(reading).x_mm, 3.0);
}

}  // namespace
}  // namespace merkel
