#include "drivers/probes/port_log.hpp"

#include <functional>

#include <gtest/gtest.h>

#include "drivers/probes/open_probe.hpp"
#include "tests/drivers/probes/read_samples.hpp"
#include "tests/drivers/simulation/parse_again.hpp"
#include "tests/drivers/simulation/running_device.hpp"
#include "tests/temporary_folder.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

/// Keeps all frames.
class Keeper final : public PortListener {
 public:
  void take(const RawFrame& frame) noexcept override { frames.push_back(frame); }
  void missed(std::uint64_t count) noexcept override { missed_frames += count; }

  std::vector<RawFrame> frames;
  std::uint64_t missed_frames = 0;
};

std::unique_ptr<Probe> opened_probe(const std::string& uri) {
  auto probe = open_probe(uri);
  EXPECT_TRUE(probe.has_value()) << probe.error().sentence;
  return probe ? std::move(*probe) : nullptr;
}

/// Listens during its lifetime.
class Listening {
 public:
  Listening(PortLog& log, PortListener& listener) : end_([&] { log.remove(listener); }) {
    log.add(listener);
  }
  Listening(Probe& probe, std::size_t port, PortListener& listener)
      : end_([&probe, port, &listener] { probe.remove_listener(port, listener); }) {
    probe.add_listener(port, listener);
  }
  Listening(const Listening&) = delete;
  Listening& operator=(const Listening&) = delete;
  ~Listening() { end_(); }

 private:
  std::function<void()> end_;
};

class PortLogOf : public testing::TestWithParam<std::string_view> {};

TEST_P(PortLogOf, TheBytesParseAgainToTheSameSamples) {
  RunningDevice device(GetParam(), {});
  const auto probe = opened_probe(device.uri());
  ASSERT_NE(probe, nullptr);
  ASSERT_EQ(probe->ports(), 1U);
  Keeper keeper;
  const Listening listening(*probe, 0, keeper);
  const auto samples = read_samples(*probe, 20);
  EXPECT_GE(samples.size(), 20U);
  const auto again = parse_again(device.uri(), keeper.frames);
  expect_same_samples(samples, again.samples);
  EXPECT_EQ(again.counts.frames, again.recorded.frames);
  EXPECT_EQ(again.counts.damaged, 0U);
  EXPECT_EQ(keeper.missed_frames, 0U);
  // The frames of the opening are complete.
  EXPECT_EQ(keeper.frames[0].kind, RawFrame::Kind::kOpened);
  EXPECT_EQ(again.opened, 1U);
}

std::vector<std::string_view> names() {
  std::vector<std::string_view> names;
  for (const ProtocolEntry& entry : protocol_table()) names.push_back(entry.name);
  return names;
}

INSTANTIATE_TEST_SUITE_P(Devices, PortLogOf, testing::ValuesIn(names()),
                         [](const auto& entry) { return std::string(entry.param); });

TEST(PortLog, SaysWhatWasDamagedLostAndUnplugged) {
  const TemporaryFolder folder;
  RunningDevice device("hbf1",
                       {.drop_byte = 0.002,
                        .flip_byte = 0.002,
                        .unplug_at = milliseconds{200},
                        .unplug_for = milliseconds{200}},
                       folder.path("tty"));
  const auto probe = opened_probe(device.uri());
  ASSERT_NE(probe, nullptr);
  Keeper keeper;
  const Listening listening(*probe, 0, keeper);
  std::vector<ProbeSample> samples;
  for (int reads = 0; reads < 100 && probe->device_counts()->outage_ns == 0; ++reads) {
    const auto more = read_samples(*probe, 50);
    EXPECT_GE(more.size(), 50U);
    samples.insert(samples.end(), more.begin(), more.end());
  }
  const auto more = read_samples(*probe, 200);
  EXPECT_GE(more.size(), 200U);
  samples.insert(samples.end(), more.begin(), more.end());
  const auto again = parse_again(device.uri(), keeper.frames);
  expect_same_samples(samples, again.samples);
  EXPECT_EQ(again.opened, 2U);
  EXPECT_GT(again.recorded.damaged, 3U);
  EXPECT_EQ(again.recorded.damaged, again.counts.damaged);
  EXPECT_GT(again.recorded.lost, 20U);
  EXPECT_EQ(again.recorded.lost, again.counts.lost);
  EXPECT_EQ(again.recorded.frames, again.counts.frames);
  EXPECT_EQ(probe->device_counts()->damaged, again.recorded.damaged);
}

TEST(PortLog, OfAFusedProbeThereIsOneForEachDevice) {
  RunningDevice force("mark10", {});
  RunningDevice depth("zaber", {});
  const auto probe = opened_probe("fused:" + force.uri() + "|" + depth.uri());
  ASSERT_NE(probe, nullptr);
  ASSERT_EQ(probe->ports(), 2U);
  // The ports are already being read by their own threads.
  Keeper of_force;
  Keeper of_depth;
  {
    const Listening to_force(*probe, 0, of_force);
    const Listening to_depth(*probe, 1, of_depth);
    EXPECT_GE(read_samples(*probe, 40).size(), 40U);
  }
  const auto forces = parse_again(force.uri(), of_force.frames);
  const auto depths = parse_again(depth.uri(), of_depth.frames);
  EXPECT_GE(forces.samples.size(), 40U);
  EXPECT_GE(depths.samples.size(), 1U);
  EXPECT_EQ(forces.samples.back().channels, std::uint32_t{ProbeSample::kForce});
  EXPECT_EQ(depths.samples.back().channels, std::uint32_t{ProbeSample::kDepth});
  EXPECT_EQ(of_force.missed_frames + of_depth.missed_frames, 0U);
}

TEST(PortLog, LongPortionsAreSplitAndCountedOnce) {
  PortLog log;
  Keeper keeper;
  const Listening listening(log, keeper);
  Bytes bytes(150);
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(i);
  log.received(bytes, nanoseconds{5}, {.frames = 3, .lost = 2, .damaged = 1});
  log.received({bytes.data(), 1}, nanoseconds{6}, {.frames = 4, .lost = 2, .damaged = 1});
  ASSERT_EQ(keeper.frames.size(), 4U);
  Bytes joined;
  for (int i = 0; i < 3; ++i) {
    const auto content = keeper.frames[static_cast<std::size_t>(i)].content();
    joined.insert(joined.end(), content.begin(), content.end());
    EXPECT_EQ(keeper.frames[static_cast<std::size_t>(i)].parsed, i == 2 ? 3U : 0U);
  }
  EXPECT_EQ(joined, bytes);
  EXPECT_EQ(keeper.frames[2].lost, 2U);
  EXPECT_EQ(keeper.frames[3].parsed, 1U);
  EXPECT_EQ(keeper.frames[3].lost, 0U);
}

TEST(PortLog, ALateListenerIsNotified) {
  PortLog log;
  const Bytes byte(1);
  for (int i = 0; i < 5000; ++i) log.received(byte, nanoseconds{i}, {});
  Keeper late;
  const Listening listening(log, late);
  EXPECT_TRUE(late.frames.empty());
  EXPECT_GT(late.missed_frames, 4000U);
  log.received(byte, nanoseconds{9}, {.frames = 1});
  ASSERT_EQ(late.frames.size(), 1U);
  EXPECT_EQ(late.frames[0].parsed, 1U);
}

TEST(PortLog, ARemovedListenerReceivesNothing) {
  PortLog log;
  Keeper keeper;
  { const Listening listening(log, keeper); }
  log.opened(nanoseconds{1});
  EXPECT_TRUE(keeper.frames.empty());
}

}  // namespace
}  // namespace merkel
