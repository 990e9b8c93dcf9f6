#include "drivers/probes/device_notices.hpp"

#include <gtest/gtest.h>

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(DeviceNotices, OnlyAFewPassInASecondAndTheOthersAreCounted) {
  DeviceNotices notices;
  for (int k = 0; k < 8; ++k) notices.add("noise", seconds{10} + milliseconds{k});
  EXPECT_EQ(notices.take().size(), 5U);
  notices.add("noise", seconds{10} + milliseconds{999});
  EXPECT_TRUE(notices.take().empty());
  notices.dropped(2);
  notices.add("again", seconds{11});
  const auto later = notices.take();
  ASSERT_EQ(later.size(), 2U);
  EXPECT_EQ(later[0], "6 more notices of its device were suppressed");
  EXPECT_EQ(later[1], "again");
  for (int k = 0; k < 500; ++k) notices.add("noise", seconds{20 + k});
  EXPECT_LE(notices.take().size(), 64U);
}

}  // namespace
}  // namespace merkel
