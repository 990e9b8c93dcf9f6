#include "drivers/probes/sync_lines.hpp"

#include <gtest/gtest.h>

#include "drivers/protocols/csv_columns.hpp"
#include "tests/text_has.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

std::vector<ChannelName> channels_named(const std::string& names) {
  return names_of_columns(*csv_columns_named(names, ','));
}

/// The edges of readings of one channel, one each millisecond.
std::vector<SyncEdge> edges_of(SyncLines& lines, const ChannelName& channel,
                               const std::vector<double>& values) {
  std::vector<SyncEdge> edges;
  for (std::size_t i = 0; i < values.size(); ++i) {
    DeviceReading reading;
    reading.set(channel.channel, values[i]);
    lines.take(reading, milliseconds{i}, edges);
  }
  return edges;
}

TEST(SyncLines, AColumnNamedSyncHasItsEdgesHalfWayBetweenTwoReadings) {
  const auto channels = channels_named("force_N,sync");
  auto lines = SyncLines::choose("", channels);
  ASSERT_TRUE(lines) << lines.error();
  const auto edges = edges_of(*lines, channels[1], {0, 0, 1, 1, 1, 0, 0});
  ASSERT_EQ(edges.size(), 2U);
  EXPECT_EQ(edges[0], (SyncEdge{.time = nanoseconds{1'500'000}, .line = 1, .level = 1}));
  EXPECT_EQ(edges[1].level, 0U);
  EXPECT_EQ(edges[1].time, nanoseconds{4'600'000});  // falls below 0.4
}

TEST(SyncLines, ALevelIsInTheUnitOfItsColumn) {
  const auto channels = channels_named("force_N,trigger_um");
  auto lines = SyncLines::choose("trigger_um:2000", channels);
  ASSERT_TRUE(lines) << lines.error();
  EXPECT_EQ(edges_of(*lines, channels[1], {0.0, 4.0, 0.0}).size(), 2U);  // readings are in mm
}

TEST(SyncLines, ALineThatIsHighAtFirstHasNoEdgeThere) {
  const auto channels = channels_named("force_N,sync");
  auto lines = SyncLines::choose("", channels);
  EXPECT_TRUE(edges_of(*lines, channels[1], {1, 1, 1}).empty());
}

TEST(SyncLines, AnyColumnWithALevelIsALineAndItsNoiseMakesNoEdges) {
  const auto channels = channels_named("force_N,trigger_mm");
  auto lines = SyncLines::choose("trigger_mm:2", channels);
  ASSERT_TRUE(lines) << lines.error();
  const auto edges =
      edges_of(*lines, channels[1], {0.0, 1.9, 2.1, 1.9, 2.1, 1.7, 2.2, 1.5, 1.9, 0.0});
  ASSERT_EQ(edges.size(), 2U);
  EXPECT_EQ(edges[0].time, nanoseconds{1'500'000});
  EXPECT_GT(edges[1].time, milliseconds{6});
  EXPECT_LT(edges[1].time, milliseconds{7});
}

TEST(SyncLines, AnEdgeWhereReadingsAreMissingHasNoTimeAndIsLeftOut) {
  const auto channels = channels_named("force_N,sync");
  auto lines = SyncLines::choose("", channels);
  std::vector<SyncEdge> edges;
  DeviceReading reading;
  for (const auto& [ms, value, lost] :
       std::vector<std::tuple<int, double, std::uint32_t>>{{0, 0, 0}, {9, 1, 8}, {10, 0, 0}}) {
    reading.set(channels[1].channel, value);
    reading.lost = lost;
    lines->take(reading, milliseconds{ms}, edges);
  }
  ASSERT_EQ(edges.size(), 1U);
  EXPECT_EQ(edges[0].level, 0U);
}

TEST(SyncLines, AWrongChoiceIsRefusedWithTheChannelsAndAnExample) {
  const auto channels = channels_named("force_N,thumb_N");
  EXPECT_TRUE(has(SyncLines::choose("index_N", channels).error(), "force_N, thumb_N"));
  EXPECT_TRUE(has(SyncLines::choose("thumb_N:high", channels).error(), "sync=thumb_N:1.5"));
  EXPECT_TRUE(has(SyncLines::choose("thumb_N:0", channels).error(), "sync=thumb_N:1.5"));
  EXPECT_TRUE(SyncLines::choose("thumb_N:1.5,force_N", channels));
}

}  // namespace
}  // namespace merkel
