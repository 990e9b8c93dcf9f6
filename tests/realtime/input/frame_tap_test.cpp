#include "realtime/input/frame_tap.hpp"

#include <gtest/gtest.h>

#include "realtime/threads/thread_rights.hpp"

namespace merkel {
namespace {

/// A probe with one port, whose traffic the test controls.
class OnePort final : public Probe {
 public:
  [[nodiscard]] std::span<const ProbeInfo> outputs() const noexcept override { return {&info_, 1}; }
  [[nodiscard]] Expected<std::size_t, ProbeError> read(Readings&,
                                                       std::chrono::milliseconds) override {
    return std::size_t{0};
  }
  [[nodiscard]] std::size_t ports() const noexcept override { return 1; }
  void add_listener(std::size_t, PortListener& listener) override { listener_ = &listener; }
  void remove_listener(std::size_t, PortListener&) override { listener_ = nullptr; }

  void say(const RawFrame& frame) {
    if (listener_ != nullptr) listener_->take(frame);
  }

 private:
  ProbeInfo info_;
  PortListener* listener_ = nullptr;
};

TEST(FrameTap, CountsFramesDroppedWhenFull) {
  OnePort probe;
  Feed<PortFrame> feed(16);
  FrameTap tap(probe, 1, 0, feed);
  constexpr std::uint32_t kFrames = 500;
  for (std::uint32_t i = 0; i < kFrames; ++i) probe.say({.parsed = i});
  tap.end();
  EXPECT_TRUE(feed.ended());
  probe.say({});
  std::uint32_t taken = 0;
  // The oldest frames are kept, in order.
  for (PortFrame item; feed.try_pop(item);) {
    EXPECT_EQ(item.probe, 1U);
    EXPECT_EQ(item.frame.parsed, taken++);
  }
  EXPECT_GE(taken, 16U);
  EXPECT_EQ(taken + feed.dropped(), kFrames);
}

TEST(ThreadRights, MatchTheKernel) {
  const RunStatus::Rights rights = rights_of_this_thread();
  EXPECT_EQ(rights.scheduling_class, 0);
  EXPECT_EQ(rights.priority, 0);
  EXPECT_GE(rights.locked_memory_kB, 0);
  EXPECT_GT(rights.timer_slack_ns, 0);
  EXPECT_EQ(rights.cpu_awake, -1);
}

}  // namespace
}  // namespace merkel
