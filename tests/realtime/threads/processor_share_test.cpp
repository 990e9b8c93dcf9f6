#include "realtime/threads/processor_share.hpp"

#include <gtest/gtest.h>

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

/// Every 20 ms, checks a thread that takes a share of a processor.
/// \return the time of detection
milliseconds found_after(double share, milliseconds length) {
  ProcessorShare watch;
  for (milliseconds now{0}; now < length; now += milliseconds{20}) {
    const nanoseconds used{
        static_cast<std::int64_t>(share * 1e6 * static_cast<double>(now.count()))};
    if (watch.too_large(now, used)) return now;
  }
  return length;
}

TEST(ProcessorShare, DetectsAGreedyThreadWithinSlightlyMoreThanASecond) {
  const milliseconds found = found_after(0.99, milliseconds{10'000});
  EXPECT_GE(found, milliseconds{900});
  EXPECT_LE(found, milliseconds{1200});
}

TEST(ProcessorShare, IgnoresAThreadThatSleepsATenthOfItsTime) {
  EXPECT_EQ(found_after(0.9, milliseconds{60'000}), milliseconds{60'000});
}

TEST(ProcessorShare, IgnoresAStallOfHalfASecond) {
  ProcessorShare watch;
  nanoseconds used{0};
  for (milliseconds now{0}; now < milliseconds{10'000}; now += milliseconds{20}) {
    const bool stalled = now >= milliseconds{3000} && now < milliseconds{3500};
    used += stalled ? milliseconds{20} : milliseconds{4};
    EXPECT_FALSE(watch.too_large(now, used)) << now.count();
  }
}

}  // namespace
}  // namespace merkel
