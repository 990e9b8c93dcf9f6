// Built if liblsl is found. An inlet receives the spikes.

#include <algorithm>
#include <chrono>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <lsl_cpp.h>

#include "core/units.hpp"
#include "drivers/clock/clock_pair.hpp"
#include "drivers/sinks/open_sink.hpp"

namespace merkel {
namespace {

TEST(LslSink, AnInletReceivesEverySpikeInLslTime) {
  const std::string name = "merkel-test-" + std::to_string(read_clock_pair().monotonic.count());
  auto sink =
      open_sink("lsl:" + name, SinkSetup{.neurons = 27,
                                         .overwrite = false,
                                         .allow_remote = true,
                                         .run = {.scene = "finger", .facts = {}, .model = {}}});
  ASSERT_TRUE(sink) << sink.error().sentence;
  auto found = lsl::resolve_stream("name", name, 1, 20.0);
  ASSERT_EQ(found.size(), 1U);
  const auto found_marks = lsl::resolve_stream("name", name + ".marks", 1, 20.0);
  ASSERT_EQ(found_marks.size(), 1U);
  lsl::stream_inlet marks(found_marks[0]);
  marks.open_stream(20.0);
  lsl::stream_inlet inlet(found[0]);
  inlet.open_stream(20.0);
  lsl::stream_info info = inlet.info(20.0);
  EXPECT_EQ(info.channel_count(), 1);
  EXPECT_EQ(info.channel_format(), lsl::cf_int32);
  EXPECT_EQ(info.nominal_srate(), lsl::IRREGULAR_RATE);
  EXPECT_EQ(info.type(), "Spikes");
  EXPECT_STREQ(info.desc().child_value("scene"), "finger");
  lsl::xml_element afferent = info.desc().child("afferents").child("afferent");
  EXPECT_STREQ(afferent.child_value("neuron"), "1");
  EXPECT_STRNE(afferent.child_value("x_mm"), "");
  lsl::xml_element channel = info.desc().child("channels").child("channel");
  EXPECT_STREQ(channel.child_value("label"), "neuron");

  // LSL's clock is CLOCK_MONOTONIC in seconds: the clock of probe times.
  const std::chrono::nanoseconds before = read_clock_pair().monotonic;
  const double lsl_s = lsl::local_clock();
  const std::chrono::nanoseconds after = read_clock_pair().monotonic;
  EXPECT_GE(lsl_s, units::s_from(before) - 1e-6);
  EXPECT_LE(lsl_s, units::s_from(after) + 1e-6);

  std::vector<SpikeEvent> spikes;
  for (std::uint32_t i = 0; i < 500; ++i) {
    spikes.push_back({.time = before + std::chrono::microseconds{137} * i,
                      .neuron = 1 + i % 7 + (i % 2) * 20,
                      .patch = static_cast<std::uint16_t>(i % 2)});
  }
  ASSERT_TRUE((*sink)->write({.spikes = std::span(spikes).first(100)}));
  ASSERT_TRUE((*sink)->write({.spikes = std::span(spikes).subspan(100)}));
  EXPECT_TRUE((*sink)->flush());
  EXPECT_EQ((*sink)->delivered(), spikes.size());
  for (std::size_t i = 0; i < spikes.size(); ++i) {
    std::int32_t neuron = 0;
    const double stamp_s = inlet.pull_sample(&neuron, 1, 20.0);
    ASSERT_NE(stamp_s, 0.0) << "spike " << i << " did not come";
    EXPECT_NEAR(stamp_s, units::s_from(spikes[i].time), 1e-9);
    EXPECT_EQ(neuron, static_cast<std::int32_t>(spikes[i].neuron));
  }
  // What liblsl sends while its outlets close is later than this mark.
  const double closed_s = std::max(lsl::local_clock(), units::s_from(spikes.back().time));
  EXPECT_TRUE((*sink)->close());
  std::string mark;
  const double end_s = marks.pull_sample(&mark, 1, 20.0);
  EXPECT_EQ(mark, "merkel: end of run");
  EXPECT_NEAR(end_s, closed_s, 0.1);
  EXPECT_GE(end_s, closed_s);
}

}  // namespace
}  // namespace merkel
