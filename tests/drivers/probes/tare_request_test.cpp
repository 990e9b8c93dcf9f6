#include "drivers/probes/tare_request.hpp"

#include <gtest/gtest.h>

namespace merkel {
namespace {

TEST(TareRequest, TakesTheMeanOfTwentyReadingsOnceForEachRequest) {
  TareRequest tare;
  EXPECT_FALSE(tare.pending());
  for (const double offset : {0.0, 100.0}) {
    tare.make();
    for (int k = 1; k < 20; ++k) EXPECT_FALSE(tare.add(offset + k));
    EXPECT_TRUE(tare.pending());
    const auto mean = tare.add(offset + 20);
    ASSERT_TRUE(mean);
    EXPECT_DOUBLE_EQ(*mean, offset + 10.5);
    EXPECT_FALSE(tare.pending());
  }
}

}  // namespace
}  // namespace merkel
