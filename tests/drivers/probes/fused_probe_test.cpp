#include "drivers/probes/fused_probe.hpp"

#include <gtest/gtest.h>

#include "drivers/probes/limited_probe.hpp"
#include "drivers/probes/open_probe.hpp"
#include "tests/drivers/probes/read_samples.hpp"
#include "tests/drivers/simulation/running_device.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

/// A device with scripted samples.
class ScriptedProbe final : public Probe {
 public:
  ScriptedProbe(std::uint32_t channels, std::vector<ProbeSample> samples)
      : samples_(std::move(samples)) {
    info_.uri = "scripted:" + std::to_string(channels);
    info_.channels = channels;
  }
  [[nodiscard]] std::span<const ProbeInfo> outputs() const noexcept override { return {&info_, 1}; }
  [[nodiscard]] ProbeStatus status() const override { return {.device = counts}; }
  [[nodiscard]] Expected<std::size_t, ProbeError> read(Readings& readings,
                                                       milliseconds patience) override {
    readings.clear();
    if (next_ == samples_.size()) {
      std::this_thread::sleep_for(patience);
      return std::size_t{0};
    }
    readings.add_sample(samples_[next_++]);
    readings.head(0).arrival = std::chrono::steady_clock::now().time_since_epoch();
    return std::size_t{1};
  }

  std::optional<DeviceCounts> counts;

 private:
  ProbeInfo info_;
  std::vector<ProbeSample> samples_;
  std::size_t next_ = 0;
};

std::vector<ProbeSample> script(std::uint32_t channel, nanoseconds from, nanoseconds step,
                                int count) {
  std::vector<ProbeSample> samples;
  for (int k = 0; k < count; ++k) {
    ProbeSample sample{.time = from + k * step, .channels = channel};
    const double t_ms = static_cast<double>(sample.time.count()) * 1e-6;
    (channel == ProbeSample::kForce ? sample.force_mN : sample.depth_mm) = t_ms;
    samples.push_back(sample);
  }
  return samples;
}

Expected<std::unique_ptr<Probe>, SetupError> fuse(std::vector<ProbeSample> force,
                                                  std::vector<ProbeSample> depth) {
  std::vector<std::unique_ptr<Probe>> members;
  members.push_back(std::make_unique<ScriptedProbe>(ProbeSample::kForce, std::move(force)));
  members.push_back(std::make_unique<ScriptedProbe>(ProbeSample::kDepth, std::move(depth)));
  return FusedProbe::fuse("fused:test", std::move(members));
}

TEST(FusedProbe, TheSecondIsInterpolatedToTheTimesOfTheFirst) {
  auto probe = fuse(script(ProbeSample::kForce, milliseconds{1000}, milliseconds{1}, 200),
                    script(ProbeSample::kDepth, milliseconds{993}, milliseconds{17}, 20));
  ASSERT_TRUE(probe.has_value());
  EXPECT_EQ((*probe)->info().channels, ProbeSample::kForce | ProbeSample::kDepth);
  const auto samples = read_samples(**probe, 200);
  ASSERT_EQ(samples.size(), 200U);
  for (std::size_t k = 0; k < samples.size(); ++k) {
    EXPECT_EQ(samples[k].time, milliseconds{1000 + k});
    EXPECT_NEAR(samples[k].force_mN, 1000.0 + static_cast<double>(k), 1e-9);
    EXPECT_NEAR(samples[k].depth_mm, 1000.0 + static_cast<double>(k), 1e-9);
    EXPECT_EQ(samples[k].channels, ProbeSample::kForce | ProbeSample::kDepth);
  }
}

TEST(FusedProbe, HalfAProbeIsNone) {
  // The stage falls silent at 1050 ms: its sample is held for 100 ms, then the output stops.
  auto probe = fuse(script(ProbeSample::kForce, milliseconds{1000}, milliseconds{1}, 600),
                    script(ProbeSample::kDepth, milliseconds{1000}, milliseconds{10}, 6));
  ASSERT_TRUE(probe.has_value());
  const auto samples = read_samples(**probe, 151);
  ASSERT_EQ(samples.size(), 151U);
  EXPECT_EQ(samples.back().time, milliseconds{1150});
  EXPECT_NEAR(samples.back().depth_mm, 1050.0, 1e-9);
  EXPECT_TRUE(read_samples(**probe, 1, 20).empty());
}

TEST(FusedProbe, SamplesBeforeTheSecondBeginsAreLeftOut) {
  auto probe = fuse(script(ProbeSample::kForce, milliseconds{1000}, milliseconds{1}, 100),
                    script(ProbeSample::kDepth, milliseconds{1030}, milliseconds{10}, 20));
  ASSERT_TRUE(probe.has_value());
  const auto samples = read_samples(**probe, 70);
  ASSERT_FALSE(samples.empty());
  EXPECT_EQ(samples.front().time, milliseconds{1030});
}

// What a member says of its readings is said of the sample, whichever member is first.
TEST(FusedProbe, DoubtsAndTaresOfEveryMemberCount) {
  for (const bool force_first : {true, false}) {
    auto force = script(ProbeSample::kForce, milliseconds{1000}, milliseconds{10}, 10);
    for (std::size_t k = 3; k < 6; ++k) force[k].set_doubts(ProbeSample::kOutsideCalibration);
    force[7].touch = Touch::kTared;
    force[7].force_mN = force[8].force_mN = force[9].force_mN = 0.0;
    auto depth = script(ProbeSample::kDepth, milliseconds{1005}, milliseconds{5}, 20);
    std::vector<std::unique_ptr<Probe>> members;
    members.push_back(std::make_unique<ScriptedProbe>(ProbeSample::kForce, force));
    members.insert(force_first ? members.end() : members.begin(),
                   std::make_unique<ScriptedProbe>(ProbeSample::kDepth, depth));
    auto probe = FusedProbe::fuse("fused:test", std::move(members));
    ASSERT_TRUE(probe);
    const auto samples = read_samples(**probe, force_first ? 9 : 17);
    std::size_t tares = 0;
    for (const ProbeSample& sample : samples) {
      const bool doubted = sample.time > milliseconds{1020} && sample.time < milliseconds{1060};
      const bool exact = sample.time >= milliseconds{1030} && sample.time <= milliseconds{1050};
      if (exact || !doubted) {
        EXPECT_EQ(sample.doubts(), doubted ? ProbeSample::kOutsideCalibration : 0)
            << sample.time.count();
      }
      if (sample.touch == Touch::kTared) ++tares;
      // No value lies between those before and after the tare.
      if (sample.time < milliseconds{1070}) {
        EXPECT_GE(sample.force_mN, 1000.0);
      } else {
        EXPECT_EQ(sample.force_mN, 0.0);
      }
    }
    EXPECT_EQ(tares, 1U);
  }
}

TEST(FusedProbe, DevicesOfTwoPortsAreOneProbe) {
  RunningDevice gauge("mark10", {});
  RunningDevice stage("zaber", {});
  auto probe = open_probe("fused:" + gauge.uri() + "|" + stage.uri());
  ASSERT_TRUE(probe.has_value()) << probe.error().sentence;
  const auto samples = read_samples(**probe, 200);
  ASSERT_GE(samples.size(), 200U);
  double depth_mm = 0.0;
  double force_mN = 0.0;
  for (const ProbeSample& sample : samples) {
    depth_mm = std::max(depth_mm, sample.depth_mm);
    force_mN = std::max(force_mN, sample.force_mN);
  }
  EXPECT_GT(depth_mm, 0.5);
  EXPECT_GT(force_mN, 250.0);
  ASSERT_TRUE((*probe)->device_counts());
  EXPECT_GT((*probe)->device_counts()->readings, 200U);
}

TEST(FusedProbe, ItsCountsAreThoseOfAllMembers) {
  auto force = std::make_unique<ScriptedProbe>(ProbeSample::kForce, std::vector<ProbeSample>{});
  auto depth = std::make_unique<ScriptedProbe>(ProbeSample::kDepth, std::vector<ProbeSample>{});
  force->counts = DeviceCounts{{.refused = 2, .duplicates = 30, .largest_batch = 7}, "one"};
  depth->counts = DeviceCounts{{.refused = 5, .duplicates = 70, .largest_batch = 4}, "two"};
  depth->counts->clock_rate = 0.5;
  depth->counts->uncertainty_us = 8.0;
  std::vector<std::unique_ptr<Probe>> members;
  members.push_back(std::move(force));
  members.push_back(std::move(depth));
  const auto probe = FusedProbe::fuse("fused:test", std::move(members));
  ASSERT_TRUE(probe);
  const DeviceCounts counts = *(*probe)->device_counts();
  EXPECT_EQ(counts.refused, 7U);
  EXPECT_EQ(counts.duplicates, 100U);
  EXPECT_EQ(counts.largest_batch, 7U);
  EXPECT_EQ(counts.port, "one and two");
  EXPECT_EQ(counts.clock_rate, 0.5);
  EXPECT_EQ(counts.uncertainty_us, 8.0);
}

TEST(LimitedProbe, CountsTheSamplesOfADeviceThatItRefuses) {
  std::vector<ProbeSample> samples =
      script(ProbeSample::kForce, milliseconds{1}, milliseconds{1}, 10);
  for (std::size_t k = 0; k < 4; ++k) samples[2 * k].force_mN = 60'000.0;
  auto scripted = std::make_unique<ScriptedProbe>(ProbeSample::kForce, samples);
  scripted->counts = DeviceCounts{{.refused = 100}};
  LimitedProbe probe(std::move(scripted), {});
  EXPECT_EQ(read_samples(probe, 6).size(), 6U);
  EXPECT_EQ(probe.device_counts()->refused, 104U);
  EXPECT_EQ(probe.take_notices().size(), 1U);
  EXPECT_TRUE(probe.take_notices().empty());
}

TEST(FusedProbe, MembersThatCannotBeFusedAreNamed) {
  const auto sentence = [](const std::string& uri) { return open_probe(uri).error().sentence; };
  EXPECT_NE(sentence("fused:").find("fewer than two members"), std::string::npos);
  EXPECT_NE(sentence("fused:sim:ramp|sim:ramp").find("is a recording"), std::string::npos);
  EXPECT_NE(sentence("fused:fused:x").find("cannot be a member"), std::string::npos);
  std::vector<std::unique_ptr<Probe>> same;
  for (int i = 0; i < 2; ++i) {
    same.push_back(
        std::make_unique<ScriptedProbe>(ProbeSample::kForce, std::vector<ProbeSample>{}));
  }
  EXPECT_NE(FusedProbe::fuse("fused:x", std::move(same)).error().sentence.find("remove it"),
            std::string::npos);
}

}  // namespace
}  // namespace merkel
