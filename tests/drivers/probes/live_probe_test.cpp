#include <chrono>
#include <vector>

#include <gtest/gtest.h>

#include "drivers/probes/open_probe.hpp"
#include "drivers/probes/played_probe.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

nanoseconds host_now() { return std::chrono::steady_clock::now().time_since_epoch(); }

std::vector<ProbeSample> all_of(Probe& probe) {
  std::vector<ProbeSample> all;
  std::vector<ProbeSample> some(100);
  while (const auto count = probe.read(some, milliseconds{20})) {
    all.insert(all.end(), some.begin(), some.begin() + static_cast<std::ptrdiff_t>(*count));
  }
  return all;
}

const std::string kPress = "sim:ramp?wait_s=0.01&hold_s=0.1&tail_s=0.02&rate_hz=2000";

TEST(LiveProbe, GivesTheRecordingsSamplesAtTheHostsTime) {
  auto recording = open_probe(kPress);
  auto live = open_probe(kPress + "&live=1");
  ASSERT_TRUE(recording && live);
  EXPECT_TRUE((*recording)->info().replayed);
  EXPECT_FALSE((*live)->info().replayed);
  EXPECT_EQ((*live)->info().uri, kPress + "&live=1");
  EXPECT_EQ((*live)->info().period, (*recording)->info().period);
  const std::vector<ProbeSample> expected = all_of(**recording);
  const nanoseconds before = host_now();
  const std::vector<ProbeSample> got = all_of(**live);
  const nanoseconds after = host_now();
  ASSERT_EQ(got.size(), expected.size());
  const nanoseconds shift = got[0].time - expected[0].time;
  for (std::size_t i = 0; i < got.size(); ++i) {
    EXPECT_EQ(got[i].time, expected[i].time + shift);
    EXPECT_EQ(got[i].depth_mm, expected[i].depth_mm);
    EXPECT_EQ(got[i].sequence, expected[i].sequence);
    EXPECT_GE(got[i].arrival, got[i].time);  // none arrives before its time
    EXPECT_GE(got[i].time, before);
    EXPECT_LE(got[i].arrival, after);
  }
}

TEST(LiveProbe, WaitsNoLongerThanItsPatience) {
  auto live = open_probe("sim:ramp?rate_hz=1&live=1");
  std::vector<ProbeSample> some(10);
  EXPECT_EQ((*live)->read(some, milliseconds{1}), 1U);  // the first one is due at once
  EXPECT_EQ((*live)->read(some, milliseconds{1}), 0U);
}

TEST(LiveProbe, IsAskedForByZeroOrOne) {
  EXPECT_TRUE((*open_probe(kPress + "&live=0"))->info().replayed);
  EXPECT_FALSE((*open_probe("replay:tests/traces/taps.csv?live=1"))->info().replayed);
  EXPECT_FALSE(open_probe(kPress + "&live=2"));
}

}  // namespace
}  // namespace merkel
