#include "tools/run/stop_signal.hpp"

#include <atomic>
#include <csignal>

#include <gtest/gtest.h>

namespace merkel {
namespace {

TEST(StopSignal, OfAnEarlierRunDoesNotStopTheNextOne) {
  std::atomic<bool> first_flag{false};
  {
    const StopSignal first(first_flag);
    EXPECT_FALSE(first.requested());
    std::raise(SIGTERM);
    EXPECT_TRUE(first.requested());
    EXPECT_TRUE(first_flag);
  }
  std::atomic<bool> flag{false};
  const StopSignal second(flag);
  EXPECT_FALSE(second.requested());
  EXPECT_FALSE(flag);
  std::raise(SIGTERM);
  EXPECT_TRUE(second.requested());
  EXPECT_TRUE(flag);
}

}  // namespace
}  // namespace merkel
