#include "drivers/probes/replay_probe.hpp"

#include <gtest/gtest.h>

#include "drivers/probes/open_probe.hpp"
#include "tests/temporary_folder.hpp"

namespace merkel {
namespace {

constexpr std::chrono::milliseconds kPatience{10};

TEST(ReplayProbe, HandsOverNoMoreThanItsChunk) {
  const TemporaryFolder folder;
  std::string rows = "time_s,depth_mm\n";
  for (int k = 0; k < 100; ++k) rows += std::to_string(k) + ",1\n";
  auto probe = open_probe("replay:" + folder.file("t.csv", rows) + "?chunk=7");
  ASSERT_TRUE(probe) << probe.error().sentence;
  std::vector<ProbeSample> samples(1000);
  std::size_t total = 0;
  for (;;) {
    const auto count = (*probe)->read(samples, kPatience);
    if (!count) {
      EXPECT_EQ(count.error(), ProbeError::kEndOfStream);
      break;
    }
    EXPECT_LE(*count, 7U);
    EXPECT_EQ(samples[0].time, std::chrono::seconds{total});
    total += *count;
  }
  EXPECT_EQ(total, 100U);
}

TEST(ReplayProbe, KnowsThePeriodInSpiteOfDropouts) {
  const TemporaryFolder folder;
  const auto probe = open_probe(
      "replay:" + folder.file("t.csv", "time_s,depth_mm\n0,1\n0.002,1\n0.004,1\n1,1\n1.002,1\n"));
  ASSERT_TRUE(probe);
  EXPECT_EQ((*probe)->info().period, std::chrono::milliseconds{2});
  EXPECT_TRUE((*probe)->info().replayed);
}

TEST(ReplayProbe, OnlyARegularRecordingHasOutages) {
  const TemporaryFolder folder;
  for (const bool regular : {true, false}) {
    std::string rows = "time_s,depth_mm\n";
    int time_ms = 0;
    for (int k = 0; k < 60; ++k) {
      rows += std::to_string(0.001 * time_ms) + ",1\n";
      time_ms += regular || k % 2 == 0 ? 4 : 30;
    }
    auto probe = open_probe("replay:" + folder.file(regular ? "r.csv" : "i.csv", rows));
    ASSERT_TRUE(probe) << probe.error().sentence;
    std::vector<ProbeSample> samples(10);
    const auto count = (*probe)->read(samples, kPatience);
    ASSERT_TRUE(count && *count > 0);
    EXPECT_EQ(samples[0].valid_for.count() > 0, regular);
  }
}

/// How long the samples of a recording are valid.
std::vector<std::chrono::nanoseconds> validities(const std::string& uri) {
  auto probe = open_probe(uri);
  if (!probe) {
    ADD_FAILURE() << probe.error().sentence;
    return {};
  }
  std::vector<ProbeSample> samples(1000);
  std::vector<std::chrono::nanoseconds> valid;
  while (const auto count = (*probe)->read(samples, kPatience)) {
    for (std::size_t i = 0; i < *count; ++i) valid.push_back(samples[i].valid_for);
  }
  return valid;
}

TEST(ReplayProbe, TheValidityOfARecordingHoldsAlsoIfItBeginsLate) {
  const TemporaryFolder folder;
  std::string rows = "time_s,depth_mm\n";
  for (int k = 0; k < 900; ++k) {
    if (k == 300) rows += "# valid_for_s=0.5\n";
    if (k == 600) rows += "# valid_for_s=0\n";
    rows += std::to_string(0.001 * k) + ",1\n";
  }
  const std::string trace = folder.file("t.csv", rows);
  for (const char* const chunk : {"?chunk=256", "?chunk=1000"}) {
    const auto valid = validities("replay:" + trace + chunk);
    ASSERT_EQ(valid.size(), 900U);
    EXPECT_GT(valid[299].count(), 0);
    EXPECT_LT(valid[299], std::chrono::milliseconds{500});
    EXPECT_EQ(valid[300], std::chrono::milliseconds{500});
    EXPECT_EQ(valid[599], std::chrono::milliseconds{500});
    EXPECT_EQ(valid[600].count(), 0);
  }
}

TEST(ReplayProbe, AnEndlessValidityHoldsAlsoIfItIsTheOnlyOneAndBeginsLate) {
  const TemporaryFolder folder;
  std::string rows = "time_s,depth_mm\n";
  for (int k = 0; k < 600; ++k) {
    if (k == 300) rows += "# valid_for_s=0\n";
    rows += std::to_string(0.001 * k) + ",1\n";
  }
  const auto valid = validities("replay:" + folder.file("t.csv", rows));
  ASSERT_EQ(valid.size(), 600U);
  EXPECT_GT(valid[299].count(), 0);
  EXPECT_EQ(valid[300].count(), 0);
}

TEST(ReplayProbe, GivesTheSamplesBeforeABadRowAndThenSaysWhereItIs) {
  const TemporaryFolder folder;
  std::string rows = "time_s,depth_mm\n";
  for (int k = 0; k < 400; ++k) rows += std::to_string(k) + ",1\n";
  auto probe = open_probe("replay:" + folder.file("t.csv", rows + "nonsense\n"));
  ASSERT_TRUE(probe);
  std::vector<ProbeSample> samples(150);
  std::size_t total = 0;
  auto count = (*probe)->read(samples, kPatience);
  for (; count; count = (*probe)->read(samples, kPatience)) total += *count;
  EXPECT_EQ(count.error(), ProbeError::kBadData);
  EXPECT_NE((*probe)->error_message().find("t.csv:402: this row has 1 field,"), std::string::npos);
  EXPECT_GE(total, 150U);
}

TEST(ReplayProbe, RefusesATraceWithoutSamples) {
  const TemporaryFolder folder;
  const auto probe = open_probe("replay:" + folder.file("t.csv", "time_s,depth_mm\n"));
  ASSERT_FALSE(probe);
  EXPECT_NE(probe.error().sentence.find("has no samples"), std::string::npos);
}

TEST(OpenProbe, NamesTheSchemesItKnows) {
  EXPECT_NE(open_probe("smell:rose").error().sentence.find("replay:FILE, sim:SHAPE"),
            std::string::npos);
  EXPECT_NE(open_probe("nothing").error().sentence.find("is not a URI"), std::string::npos);
}

}  // namespace
}  // namespace merkel
