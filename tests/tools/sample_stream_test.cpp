#include "tools/scene/sample_stream.hpp"

#include <vector>

#include <gtest/gtest.h>

#include "drivers/protocols/trace_file.hpp"
#include "drivers/sample_limits.hpp"
#include "realtime/output/spike_callback.hpp"
#include "tools/scene/prepared_run.hpp"
#include "tools/scene/scene_presets.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
constexpr std::uint32_t kDepth = ProbeSample::kDepth;

std::vector<ProbeSample> samples_of(const std::string& trace) {
  auto reader = TraceReader::open(trace);
  std::vector<ProbeSample> samples(100'000);
  samples.resize(reader->read(samples).value_or(0));
  return samples;
}

std::vector<SpikeEvent> spikes_of_pipeline(Scene scene, const std::string& trace) {
  EXPECT_TRUE(scene.set_probes({"replay:" + trace}));
  auto run = prepare_run(std::move(scene), {.fast = true});
  EXPECT_TRUE(run);
  Pipeline pipeline(*run->model, run->parameters);
  run->add_probes_to(pipeline);
  std::vector<SpikeEvent> spikes;
  pipeline.add_sink(std::make_unique<SpikeCallback>("test", [&](std::span<const SpikeEvent> some) {
    spikes.insert(spikes.end(), some.begin(), some.end());
  }));
  EXPECT_TRUE(pipeline.run());
  return spikes;
}

TEST(SampleStream, GivesTheSpikesOfAPipelineThatReplaysTheSamples) {
  for (const char* const preset : {"paper", "finger"}) {
    for (const char* const trace : {"tests/traces/taps.csv", "tests/traces/slide.csv"}) {
      const Scene scene = *preset_scene(preset);
      const std::vector<ProbeSample> samples = samples_of(trace);
      ASSERT_FALSE(samples.empty());
      auto stream = SampleStream::create(scene, {samples.front().channels});
      ASSERT_TRUE(stream) << stream.error().sentence;
      std::vector<SpikeEvent> spikes;
      for (const ProbeSample& sample : samples) {
        const auto some = stream->push(0, sample);
        ASSERT_TRUE(some) << some.error().sentence;
        spikes.insert(spikes.end(), some->begin(), some->end());
      }
      const auto last = stream->finish();
      spikes.insert(spikes.end(), last.begin(), last.end());
      EXPECT_GT(spikes.size(), 10U);
      EXPECT_EQ(spikes, spikes_of_pipeline(scene, trace)) << preset << " " << trace;
    }
  }
}

TEST(SampleStream, RefusesWhatCannotBeAndGoesOn) {
  auto stream = SampleStream::create(*preset_scene("paper"), {kDepth});
  ASSERT_TRUE(stream);
  const auto push = [&](int ms, double depth_mm, std::size_t probe = 0) {
    const auto result =
        stream->push(probe, {.time = milliseconds{ms}, .depth_mm = depth_mm, .channels = kDepth});
    return result ? std::string() : result.error().sentence;
  };
  EXPECT_EQ(push(0, 0.1), "");
  EXPECT_FALSE(stream->time());
  EXPECT_EQ(push(0, 0.2),
            "the probe 0 received a sample of 0 s after one of 0 s: push samples in order of time");
  EXPECT_NE(push(1, 1e9).find("too large for a finger"), std::string::npos);
  EXPECT_NE(push(1, 20.0).find("beyond the limit of 15"), std::string::npos);
  EXPECT_NE(push(1, 0.1, 1).find("there is no probe 1"), std::string::npos);
  EXPECT_EQ(push(3, 0.2), "");
  EXPECT_EQ(stream->time(), milliseconds{2});
  EXPECT_EQ(stream->ticks(), 2U);
  static_cast<void>(stream->finish());
  EXPECT_NE(push(9, 0.2).find("the stream is finished"), std::string::npos);
}

TEST(SampleStream, WaitsForEveryProbe) {
  Scene scene = *preset_scene("hand");
  auto stream =
      SampleStream::create(scene, std::vector<std::uint32_t>(scene.probes.size(), kDepth));
  ASSERT_TRUE(stream);
  const auto push = [&](std::size_t probe, int ms) {
    return stream->push(probe, {.time = milliseconds{ms}, .depth_mm = 0.1, .channels = kDepth});
  };
  for (int ms = 0; ms < 5000; ++ms) {
    const auto pushed = push(0, ms);
    if (!pushed) {
      EXPECT_NE(pushed.error().sentence.find("ahead of another probe"), std::string::npos);
      break;
    }
    ASSERT_LT(ms, 4999);
  }
  EXPECT_EQ(stream->ticks(), 0U);
  for (std::size_t probe = 1; probe < scene.probes.size(); ++probe) {
    EXPECT_TRUE(push(probe, 0));
    EXPECT_TRUE(push(probe, 10));
  }
  EXPECT_EQ(stream->ticks(), 9U);
  EXPECT_FALSE(SampleStream::create(scene, {kDepth}));
}

}  // namespace
}  // namespace merkel
