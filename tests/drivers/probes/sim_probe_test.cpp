#include "drivers/probes/sim_probe.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <regex>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "drivers/probes/open_probe.hpp"

namespace merkel {
namespace {

std::vector<ProbeSample> samples_of(const std::string& uri) {
  auto probe = open_probe(uri);
  EXPECT_TRUE(probe) << probe.error().sentence;
  std::vector<ProbeSample> all;
  std::vector<ProbeSample> some(100);
  while (const auto count = (*probe)->read(some, std::chrono::milliseconds{1})) {
    all.insert(all.end(), some.begin(), some.begin() + static_cast<std::ptrdiff_t>(*count));
  }
  return all;
}

TEST(SimProbe, RampHoldsItsDepth) {
  const auto samples =
      samples_of("sim:ramp?depth_mm=2&wait_s=0.1&ramp_s=0.1&hold_s=1&tail_s=0.2&rate_hz=100");
  ASSERT_EQ(samples.size(), 151U);
  EXPECT_EQ(samples[10].depth_mm, 0.0);
  EXPECT_NEAR(samples[15].depth_mm, 1.0, 1e-12);
  EXPECT_EQ(samples[50].depth_mm, 2.0);
  EXPECT_EQ(samples[50].time, std::chrono::milliseconds{500});
  EXPECT_NEAR(samples[125].depth_mm, 1.0, 1e-12);
  EXPECT_EQ(samples[150].depth_mm, 0.0);
}

TEST(SimProbe, ARepeatedPressGoesOnWhereItEnded) {
  const std::string press = "sim:ramp?hold_s=0.1&rate_hz=200";
  const auto once = samples_of(press);
  const auto thrice = samples_of(press + "&repeat=3");
  ASSERT_EQ(thrice.size(), 3 * once.size());
  for (std::size_t i = 0; i < thrice.size(); ++i) {
    EXPECT_EQ(thrice[i].time, i * std::chrono::milliseconds{5});
    EXPECT_EQ(thrice[i].sequence, i);
    EXPECT_EQ(thrice[i].depth_mm, once[i % once.size()].depth_mm);
  }
}

TEST(SimProbe, TapsHaveTheRequestedCount) {
  const auto samples = samples_of("sim:taps?count=3&tap_s=0.1&interval_s=0.2&depth_mm=1");
  int onsets = 0;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    onsets += samples[i - 1].depth_mm <= 0.0 && samples[i].depth_mm > 0.0 ? 1 : 0;
  }
  EXPECT_EQ(onsets, 3);
  const auto deepest = std::max_element(
      samples.begin(), samples.end(),
      [](const ProbeSample& a, const ProbeSample& b) { return a.depth_mm < b.depth_mm; });
  EXPECT_NEAR(deepest->depth_mm, 1.0, 1e-12);
}

TEST(SimProbe, SineSwingsAboutItsDepth) {
  const auto samples = samples_of(
      "sim:sine?depth_mm=1&amplitude_mm=0.25&frequency_hz=10&wait_s=0.2&hold_s=1&ramp_s=0.1");
  int held = 0;
  for (const ProbeSample& sample : samples) {
    const double time_s = std::chrono::duration<double>(sample.time).count();
    if (time_s < 0.301 || time_s > 1.299) continue;
    const double phase = 2.0 * std::numbers::pi * 10.0 * (time_s - 0.3);
    EXPECT_NEAR(sample.depth_mm, 1.0 + 0.25 * std::sin(phase), 1e-9) << time_s;
    ++held;
  }
  EXPECT_GT(held, 900);
}

TEST(SimProbe, SlideMovesWhilePressed) {
  const auto samples = samples_of("sim:slide?x_mm=5&to_x_mm=25&speed_mm_per_s=40&y_mm=7");
  EXPECT_EQ(samples.front().x_mm, 5.0);
  EXPECT_EQ(samples.back().x_mm, 25.0);
  EXPECT_EQ(samples.front().y_mm, 7.0);
  for (std::size_t i = 1; i < samples.size(); ++i) {
    if (samples[i].x_mm != samples[i - 1].x_mm) {
      EXPECT_GT(samples[i].depth_mm, 1.48);
    }
  }
}

TEST(SimProbe, ScanSlidesInPassesAndReturnsLifted) {
  const auto samples = samples_of(
      "sim:scan?passes=3&step_mm=0.4&length_mm=10&speed_mm_per_s=40&direction_deg=90&force_N=0.5");
  std::vector<double> places;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const double dx = samples[i].x_mm - samples[i - 1].x_mm;
    const double dy = samples[i].y_mm - samples[i - 1].y_mm;
    if (dx != 0.0 || dy < -1e-9) {
      EXPECT_EQ(samples[i].force_mN, 0.0) << i;  // returns
    } else if (dy > 1e-9) {
      EXPECT_GT(samples[i].force_mN, 0.0) << i;
      EXPECT_LT(dy, 0.04 + 1e-9) << i;
      if (places.empty() || places.back() != samples[i].x_mm) places.push_back(samples[i].x_mm);
    }
  }
  ASSERT_EQ(places.size(), 3U);
  EXPECT_NEAR(places[0], 15.4, 1e-9);  // counterclockwise from the direction is −x
  EXPECT_NEAR(places[1], 15.0, 1e-9);
  EXPECT_NEAR(places[2], 14.6, 1e-9);
}

TEST(SimProbe, APadIsRolledAsOftenAsSaid) {
  const auto samples =
      samples_of("sim:pad?count=3&wait_s=0.2&tap_s=0.5&interval_s=1&tail_s=0.305&rate_hz=100");
  ASSERT_EQ(samples.size(), 301U);
  for (const std::size_t press : {0U, 1U, 2U}) {
    EXPECT_NEAR(samples[45 + 100 * press].force_mN, 1000.0, 20.0) << press;  // the sum of taxels
    EXPECT_EQ(samples[80 + 100 * press].force_mN, 0.0) << press;
  }
}

TEST(SimProbe, ForceInsteadOfDepth) {
  const auto samples = samples_of("sim:ramp?force_N=0.2");
  EXPECT_TRUE(samples[1000].has(ProbeSample::kForce));
  EXPECT_FALSE(samples[1000].has(ProbeSample::kDepth));
  EXPECT_NEAR(samples[1000].force_mN, 200.0, 1e-9);
}

TEST(SimProbe, FaultsAreSeededAndLeaveTimeInOrder) {
  const std::string uri =
      "sim:ramp?jitter_us=400&noise_um=10&dropouts_per_s=2&dropout_ms=80&seed=5";
  const auto samples = samples_of(uri);
  EXPECT_LT(samples.size(), 2741U);
  EXPECT_GT(samples.size(), 1500U);
  double noise2 = 0.0;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    ASSERT_GT(samples[i].time, samples[i - 1].time);
    const double t = std::chrono::duration<double>(samples[i].time).count();
    if (t > 0.3 && t < 2.0) noise2 += std::pow(samples[i].depth_mm - 1.5, 2);
  }
  EXPECT_GT(noise2, 0.0);
  const auto again = samples_of(uri);
  ASSERT_EQ(again.size(), samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    EXPECT_EQ(again[i].time, samples[i].time);
    EXPECT_EQ(again[i].depth_mm, samples[i].depth_mm);
  }
  EXPECT_NE(samples_of(uri + "1")[3].depth_mm, samples[3].depth_mm);
}

TEST(SimProbe, RefusesOptionsItDoesNotKnow) {
  const auto sentence = [](const char* uri) { return open_probe(uri).error().sentence; };
  EXPECT_NE(sentence("sim:ramp?dept_mm=1").find("did you mean depth_mm?"), std::string::npos);
  EXPECT_NE(sentence("sim:ramp?depth_mm=deep").find("a number from 0 to 1000"), std::string::npos);
  EXPECT_NE(sentence("sim:ramp?depth_mm=nan").find("a number from 0 to 1000"), std::string::npos);
  EXPECT_NE(sentence("sim:wave")
                .find("sim:ramp, sim:taps, sim:sine, sim:slide, sim:scan, sim:grasp or sim:pad"),
            std::string::npos);
}

/// The options and defaults that the help lists for a shape.
std::vector<std::pair<std::string, std::string>> options_of(const std::string& shape) {
  const std::string help = kSimProbeHelp;
  const auto begin = help.find("\n  " + shape + " ");
  auto end = help.find("\n  ", begin + 1);
  while (end != std::string::npos && help[end + 3] == ' ') end = help.find("\n  ", end + 1);
  const std::string text = help.substr(begin, end - begin);
  std::vector<std::pair<std::string, std::string>> options;
  static const std::regex kOption("([a-z]+[a-z_NH]*) \\(([0-9.]+)");
  for (std::sregex_iterator it(text.begin(), text.end(), kOption), last; it != last; ++it) {
    options.emplace_back((*it)[1], (*it)[2]);
  }
  return options;
}

TEST(SimProbe, EveryOptionOfTheHelpIsTakenAndItsDefaultChangesNothing) {
  const auto depth_of = [](const std::string& uri) {
    std::vector<double> values;
    for (const ProbeSample& sample : samples_of(uri)) {
      values.push_back(sample.depth_mm);
      values.push_back(sample.force_mN);
    }
    return values;
  };
  std::size_t tried = 0;
  for (const std::string shape : {"ramp", "taps", "sine", "slide", "scan"}) {
    auto options = options_of(shape);
    for (auto& option : options_of("all")) options.push_back(option);
    for (const auto& [key, value] : options) {
      if (shape == "slide" && key == "x_mm") continue;  // has a different default there
      const bool force = key == "noise_mN" || key == "amplitude_N" || key == "force_N";
      const std::string base = "sim:" + shape + (force ? "?force_N=0.1" : "");
      const std::string given =
          key == "force_N" ? base : base + (force ? "&" : "?") + key + "=" + value;
      EXPECT_EQ(depth_of(given), depth_of(base)) << given;
      ++tried;
    }
  }
  EXPECT_GT(tried, 60U);
}

}  // namespace
}  // namespace merkel
