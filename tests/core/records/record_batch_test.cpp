#include "core/records/record_batch.hpp"

#include <bit>
#include <chrono>
#include <set>

#include <gtest/gtest.h>

namespace merkel {
namespace {

using std::chrono::milliseconds;

TEST(RecordBatch, EveryKindHasABitOfItsOwn) {
  std::set<std::uint32_t> bits;
  std::size_t kinds = 0;
  for_each_kind(RecordLists<RecordKind>{}, [&]<class Record>(const RecordKind<Record>&) {
    EXPECT_TRUE(std::has_single_bit(kKind<Record>));
    bits.insert(kKind<Record>);
    ++kinds;
  });
  EXPECT_EQ(bits.size(), kinds);
  EXPECT_EQ((kKinds<SpikeEvent, Mark>), kKind<SpikeEvent> | kKind<Mark>);
}

TEST(RecordBatch, RefersToTheRecordsOfEveryList) {
  RecordLists<RecordVector> lists;
  for_each_kind(lists, [](auto& list) { list.resize(2); });
  lists.ticks.resize(5);
  const RecordBatch batch = batch_of(lists);
  for_each_kind(batch, []<class Record>(std::span<const Record> list) {
    EXPECT_EQ(list.size(), (std::is_same_v<Record, TickRecord> ? 5U : 2U));
  });
  EXPECT_EQ(batch.spikes.data(), lists.spikes.data());
  EXPECT_EQ(count_of(batch), count_of(lists));
  clear_all(lists);
  EXPECT_EQ(count_of(lists), 0U);
}

TEST(RecordBatch, ARecordHasOneTime) {
  EXPECT_EQ(time_of(SpikeEvent{.time = milliseconds{3}}), milliseconds{3});
  EXPECT_EQ(time_of(DeliveredSample{.sample = {.time = milliseconds{4}}}), milliseconds{4});
  EXPECT_EQ(time_of(PortFrame{.frame = {.time = milliseconds{5}}}), milliseconds{5});
}

}  // namespace
}  // namespace merkel
