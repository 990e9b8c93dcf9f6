#include "realtime/queues/bounded_queue.hpp"

#include <thread>

#include <gtest/gtest.h>

namespace merkel {
namespace {

TEST(BoundedQueue, RefusesWhenFullAndAcceptsAgainAfterAPop) {
  BoundedQueue<int> queue(3);
  int pushed = 0;
  while (queue.try_push(pushed)) ++pushed;
  EXPECT_GE(pushed, 3);
  EXPECT_LT(pushed, 100);
  int value = -1;
  for (int expected = 0; expected < pushed; ++expected) {
    ASSERT_TRUE(queue.try_pop(value));
    EXPECT_EQ(value, expected);
  }
  EXPECT_FALSE(queue.try_pop(value));
  EXPECT_TRUE(queue.try_push(7));
}

TEST(BoundedQueue, FrontStaysValidUntilItIsPopped) {
  BoundedQueue<int> queue(3);
  EXPECT_EQ(queue.front(), nullptr);
  ASSERT_TRUE(queue.try_push(1));
  ASSERT_TRUE(queue.try_push(2));
  EXPECT_EQ(*queue.front(), 1);
  queue.pop();
  EXPECT_EQ(*queue.front(), 2);
}

TEST(BoundedQueue, KeepsTheOrderBetweenTwoThreads) {
  BoundedQueue<int> queue(64);
  constexpr int kItems = 200'000;
  std::jthread writer([&queue] {
    for (int i = 0; i < kItems; ++i) {
      while (!queue.try_push(i)) std::this_thread::yield();
    }
  });
  int value = 0;
  for (int expected = 0; expected < kItems; ++expected) {
    while (!queue.try_pop(value)) std::this_thread::yield();
    ASSERT_EQ(value, expected);
  }
}

}  // namespace
}  // namespace merkel
