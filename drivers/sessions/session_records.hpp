#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "core/contact/taxel_array.hpp"
#include "core/records/columns.hpp"
#include "core/records/record_batch.hpp"
#include "drivers/sample_limits.hpp"
#include "drivers/sessions/session_columns.hpp"
#include "drivers/sessions/session_format.hpp"

namespace merkel {

inline constexpr auto kProbeSampleColumns =
    joined_columns(column_list(column("probe", "", "from 0", &DeliveredSample::probe)),
                   columns_within(kSampleColumns, &DeliveredSample::sample));

/// Of a frame, without its bytes.
inline constexpr auto kFrameColumns = joined_columns(
    column_list(column("probe", "", "from 0", &PortFrame::probe),
                column("port", "", "of the probe, from 0", &PortFrame::port)),
    columns_within(
        column_list(time_column("time_ns", "time_s", "host-monotonic", &RawFrame::time),
                    limited_column("kind", "0 received, 1 sent, 2 opened, 3 started",
                                   &RawFrame::kind, 0.0, number_of(RawFrame::Kind::kStarted)),
                    limited_column("length", "of the bytes", &RawFrame::length, 0.0,
                                   static_cast<double>(RawFrame::kMaxBytes)),
                    column("parsed", "", "frames", &RawFrame::parsed),
                    column("damaged", "", "frames", &RawFrame::damaged),
                    column("lost", "", "frames", &RawFrame::lost)),
        &PortFrame::frame));

/// How a session stores a kind of record: the number of its stream, the type of its values, and its
/// columns. Kinds without a specialisation have no stream of numbers.
template <class Record>
struct SessionStreamOf {};

template <SessionStream::Id id, class StoredValue, const auto& columns>
struct StoredAs {
  static constexpr SessionStream::Id kId = id;
  using Value = StoredValue;
  static constexpr const auto& kColumns = columns;
};

/// The counters have tables of their own.
inline constexpr auto kStatusColumns = column_list();

template <>
struct SessionStreamOf<SpikeEvent>
    : StoredAs<SessionStream::Id::kSpikes, std::int64_t, kSpikeColumns> {};
template <>
struct SessionStreamOf<TickRecord> : StoredAs<SessionStream::Id::kTicks, double, kTickColumns> {};
template <>
struct SessionStreamOf<DeliveredSample>
    : StoredAs<SessionStream::Id::kSamples, double, kProbeSampleColumns> {};
template <>
struct SessionStreamOf<LoopEvent>
    : StoredAs<SessionStream::Id::kEvents, std::int64_t, kEventColumns> {};
template <>
struct SessionStreamOf<RunStatus>
    : StoredAs<SessionStream::Id::kStatus, std::int64_t, kStatusColumns> {};
template <>
struct SessionStreamOf<PortFrame>
    : StoredAs<SessionStream::Id::kFrames, std::int64_t, kFrameColumns> {};
template <>
struct SessionStreamOf<StimulationCommand>
    : StoredAs<SessionStream::Id::kStimulation, double, kCommandColumns> {};

template <>
struct SessionStreamOf<SentCommand> : StoredAs<SessionStream::Id::kSent, double, kSentColumns> {};
template <>
struct SessionStreamOf<SyncEdge> : StoredAs<SessionStream::Id::kSync, std::int64_t, kSyncColumns> {
};
template <>
struct SessionStreamOf<TaxelZeros>
    : StoredAs<SessionStream::Id::kTaxelZeros, double, kTaxelColumns> {};

template <>
struct SessionStreamOf<GivenDrive> : StoredAs<SessionStream::Id::kDrives, double, kDriveColumns> {};

template <class Record>
inline constexpr bool kStored = requires {
  SessionStreamOf<Record>::kId;
};
template <>
struct SessionStreamOf<TaxelBlock> : StoredAs<SessionStream::Id::kTaxels, double, kTaxelColumns> {};

/// True if each probe has a stream of its own.
template <class Record>
inline constexpr bool kOfProbe =
    std::is_same_v<Record, TickRecord> || std::is_same_v<Record, DeliveredSample>;

/// All kinds that a session stores; marks are strings.
inline constexpr std::uint32_t kSessionKinds = [] {
  std::uint32_t kinds = kKind<Mark>;
  for_each_kind(RecordLists<RecordKind>{}, [&]<class Record>(const RecordKind<Record>&) {
    if (kStored<Record>) kinds |= kKind<Record>;
  });
  return kinds;
}();

/// The values of an item of a kind.
template <class Record>
using ValuesOf = ItemValues<typename SessionStreamOf<Record>::Value>;

/// True if values are valid that the types of their members do not limit enough.
template <class Record>
bool plausible_record(const Record& /*record*/) {
  return true;
}
inline bool plausible_record(const TickRecord& tick) {
  return plausible(tick.contact.depth_mm, SampleLimits::kDepth_mm) &&
         plausible(tick.contact.force_mN, SampleLimits::kForce_mN) &&
         plausible(tick.contact.x_mm, SampleLimits::kPosition_mm) &&
         plausible(tick.contact.y_mm, SampleLimits::kPosition_mm);
}
inline bool plausible_record(const TaxelZeros& zeros) {
  return zeros.first + std::size_t{zeros.count} <= TaxelArray::kMax;
}
inline bool plausible_record(const TaxelBlock& block) {
  return block.first + std::size_t{block.count} <= TaxelArray::kMax &&
         std::all_of(block.pressure_kPa.begin(), block.pressure_kPa.end(), [](float kPa) {
           return kPa >= 0.0F && kPa <= static_cast<float>(SampleLimits::kPressure_kPa);
         });
}
inline bool plausible_record(const DeliveredSample& item) { return plausible(item.sample); }
inline bool plausible_record(const StimulationCommand& command) {
  constexpr double kLargestValue = 1e6;  // far above the limits of scenes
  return command.amplitude_uA >= 0.0 && command.amplitude_uA <= kLargestValue &&
         command.frequency_Hz >= 0.0 && command.frequency_Hz <= kLargestValue;
}

inline bool plausible_record(const SentCommand& item) { return plausible_record(item.command); }

// Writer and reader of an item: to_item() inverts values_of(). to_item() checks every value,
// because a file may hold any bytes; it returns false for an invalid one.

template <class Record>
void values_of(const Record& record, ValuesOf<Record>& values) {
  columns_to_values(SessionStreamOf<Record>::kColumns, record, values);
}

template <class Record>
[[nodiscard]] bool to_item(const ValuesOf<Record>& values, Record& record) {
  return values_to_columns(SessionStreamOf<Record>::kColumns, values, record) &&
         plausible_record(record);
}

inline void values_of(const PortFrame& item, ItemValues<std::int64_t>& values) {
  columns_to_values(kFrameColumns, item, values);
  std::memcpy(&values[count_of_columns(kFrameColumns)], item.frame.bytes.data(),
              item.frame.bytes.size());
}

[[nodiscard]] inline bool to_item(const ItemValues<std::int64_t>& values, PortFrame& item) {
  std::memcpy(item.frame.bytes.data(), &values[count_of_columns(kFrameColumns)],
              item.frame.bytes.size());
  return values_to_columns(kFrameColumns, values, item);
}

inline void values_of(const RunStatus& status, ItemValues<std::int64_t>& values) {
  std::size_t next = 0;
  const auto add = [&](const auto& fields, const auto& counters) {
    for (const auto& field : fields) {
      values[next++] = static_cast<std::int64_t>(counters.*field.cell);
    }
  };
  add(kRunCounterFields<>, status.counters);
  add(kLossFields, status.losses);
  add(kRightFields, status.rights);
}

[[nodiscard]] inline bool to_item(const ItemValues<std::int64_t>& values, RunStatus& status) {
  std::size_t next = 0;
  bool good = true;
  // A counter that an older recorder lacks is 0.
  const auto take = [&](const auto& fields, auto& counters) {
    for (const auto& field : fields) {
      const std::int64_t value = values[next++] == kMissingValue ? 0 : values[next - 1];
      good = good && value >= 0;
      counters.*field.cell = static_cast<std::uint64_t>(value);
    }
  };
  take(kRunCounterFields<>, status.counters);
  take(kLossFields, status.losses);
  for (const auto& field : kRightFields) {
    good = good && values[next] >= -1;
    status.rights.*field.cell = values[next++];
  }
  return good;
}

}  // namespace merkel
