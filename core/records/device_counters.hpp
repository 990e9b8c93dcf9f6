#pragma once

#include <algorithm>
#include <array>
#include <concepts>
#include <cstdint>

#include "core/records/counter_field.hpp"

namespace merkel {

/// All counters of a device's driver. `kDeviceCounterFields` gives the name, unit and meaning of
/// each and how those of several devices are merged; all code that prints, stores, reads or merges
/// them iterates over that table. A run's counters contain the merged ones of its devices.
///
/// \tparam Cell  as for RunCountersOf
template <class Cell>
struct DeviceCountersOf {
  Cell bytes{};
  Cell readings{};
  Cell lost{};
  Cell damaged{};
  Cell refused{};
  Cell duplicates{};
  Cell reordered{};
  Cell distrusted{};
  Cell withheld{};
  Cell saturated{};
  Cell outside_calibration{};
  Cell reboots{};
  Cell outages{};
  Cell outage_ns{};
  Cell largest_batch{};
  Cell clock_outliers{};
  Cell clock_anchors{};
  Cell overruns{};

  friend bool operator==(const DeviceCountersOf&,
                         const DeviceCountersOf&) requires std::equality_comparable<Cell>
  = default;
};

using DeviceCounters = DeviceCountersOf<std::uint64_t>;

/// The table of a device's counters. A new counter needs a member above and a row here.
template <class Cell = std::uint64_t>
inline constexpr auto kDeviceCounterFields = [] {
  using Counters = DeviceCountersOf<Cell>;
  using Row = CounterField<Counters, Cell>;
  return std::array{
      Row{"device_bytes", "", "bytes received from devices", &Counters::bytes},
      Row{"device_readings", "", "readings of devices", &Counters::readings},
      Row{"device_lost", "", "readings lost, by sequence numbers or unanswered requests",
          &Counters::lost, true},
      Row{"device_damaged", "", "frames that failed their check", &Counters::damaged, true},
      Row{"device_refused", "", "readings refused: not a number, impossible or above a limit",
          &Counters::refused, true},
      Row{"device_duplicates", "", "repeated frames, or answers without a request",
          &Counters::duplicates},
      Row{"device_reordered", "", "frames older than the newest one, dropped", &Counters::reordered,
          true},
      Row{"device_distrusted", "", "number of times that most of a device's data was damaged",
          &Counters::distrusted, true},
      Row{"device_withheld", "", "readings not used meanwhile", &Counters::withheld, true},
      Row{"device_saturated", "", "readings at the end of the sensor's range", &Counters::saturated,
          true},
      Row{"device_outside_calibration", "", "readings outside the range of their calibration",
          &Counters::outside_calibration, true},
      Row{"device_reboots", "", "restarts of a device", &Counters::reboots, true},
      Row{"device_outages", "", "number of times that a device was unplugged", &Counters::outages,
          true},
      Row{"device_outage_ns", "ns", "total time for which a device was unplugged",
          &Counters::outage_ns, true},
      Row{"device_largest_batch", "", "most readings in one read", &Counters::largest_batch, false,
          true},
      Row{"device_clock_outliers", "", "impossible device times, replaced",
          &Counters::clock_outliers},
      Row{"device_clock_anchors", "", "number of times that a device's clock jumped",
          &Counters::clock_anchors},
      Row{"device_overruns", "", "number of times that the buffer of a device's port was full",
          &Counters::overruns, true},
  };
}();

static_assert(sizeof(DeviceCounters) == kDeviceCounterFields<>.size() * sizeof(std::uint64_t),
              "every counter has its row in the table");

/// Merges the counters of another device.
constexpr void merge(DeviceCounters& all, const DeviceCounters& other) noexcept {
  for (const auto& field : kDeviceCounterFields<>) {
    std::uint64_t& cell = all.*field.cell;
    cell = field.largest ? std::max(cell, other.*field.cell) : cell + other.*field.cell;
  }
}

}  // namespace merkel
