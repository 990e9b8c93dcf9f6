#include "realtime/queues/feed.hpp"

#include <gtest/gtest.h>

#include "core/records/spike_event.hpp"

namespace merkel {
namespace {

TEST(Feed, AConsumerTakesNoMoreThanItAsksFor) {
  Feed<SpikeEvent> feed(8);
  for (std::uint32_t neuron = 1; neuron <= 5; ++neuron) {
    ASSERT_TRUE(feed.try_push({.neuron = neuron}));
  }
  EXPECT_EQ(feed.waiting(), 5U);
  std::vector<SpikeEvent> taken;
  feed.take(taken, 2);
  ASSERT_EQ(taken.size(), 2U);
  feed.take(taken);
  ASSERT_EQ(taken.size(), 5U);
  for (std::uint32_t i = 0; i < 5; ++i) EXPECT_EQ(taken[i].neuron, i + 1);
  EXPECT_FALSE(feed.ended());
  feed.end();
  EXPECT_TRUE(feed.ended());
}

TEST(Feed, MarksKeepTheirTextAndRefuseWhenFull) {
  Feed<Mark> feed(2);
  const std::string label(1000, 'x');
  EXPECT_TRUE(feed.try_push({.label = label}));
  EXPECT_TRUE(feed.try_push({.label = "second"}));
  EXPECT_FALSE(feed.try_push({.label = "third"}));
  std::vector<Mark> marks;
  feed.take(marks);
  ASSERT_EQ(marks.size(), 2U);
  EXPECT_EQ(marks[0].label, label);
  EXPECT_TRUE(feed.try_push({.label = "fourth"}));
}

}  // namespace
}  // namespace merkel
