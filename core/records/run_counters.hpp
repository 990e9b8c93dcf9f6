#pragma once

#include <algorithm>
#include <array>
#include <concepts>
#include <cstdint>

#include "core/records/device_counters.hpp"

namespace merkel {

/// All counters of a run, including those of its devices. `kRunCounterFields` gives the name, unit
/// and meaning of each; all code that prints, stores or reads counters iterates over that table.
///
/// \tparam Cell  `std::uint64_t` for a snapshot; an atomic counter where threads update it
template <class Cell>
struct RunCountersOf : DeviceCountersOf<Cell> {
  Cell ticks{};
  Cell overruns{};
  Cell longest_overrun_ns{};
  Cell overruns_by_late_wake_up{};
  Cell overruns_by_long_compute{};
  Cell catch_up_ticks{};
  Cell gaps{};
  Cell skipped_ticks{};
  Cell held_ticks{};
  Cell released_ticks{};
  Cell releases{};
  Cell spikes{};
  Cell neuron_resets{};
  Cell spikes_refused{};
  Cell samples{};
  Cell samples_late{};
  Cell samples_dropped{};
  Cell spikes_dropped{};
  Cell events_dropped{};
  Cell timings_dropped{};
  Cell demotions{};
  Cell commands{};
  Cell commands_limited{};
  Cell commands_rounded{};
  Cell largest_rounding_nA{};
  Cell largest_rounding_mHz{};
  Cell commands_dropped{};
  Cell stimulation_stops{};
  Cell commands_withheld{};
  Cell commands_slowed{};
  Cell stale_stops{};
  Cell commands_refused{};
  Cell probe_count{};
  Cell probes_ended{};

  friend bool operator==(const RunCountersOf&,
                         const RunCountersOf&) requires std::equality_comparable<Cell>
  = default;
};

using RunCounters = RunCountersOf<std::uint64_t>;

/// The table of a run's counters: its own, then those of its devices. A new counter needs a member
/// above and a row here.
template <class Cell = std::uint64_t>
inline constexpr auto kRunCounterFields = [] {
  using Counters = RunCountersOf<Cell>;
  using Row = CounterField<Counters, Cell>;
  constexpr std::array kOwn{
      Row{"ticks", "", "ticks simulated", &Counters::ticks},
      Row{"overruns", "", "ticks that ended after the next tick was due", &Counters::overruns,
          true},
      Row{"longest_overrun_ns", "ns", "longest time by which a tick overran",
          &Counters::longest_overrun_ns},
      Row{"overruns_by_late_wake_up", "", "overruns caused by the host: a late wake-up, or a stop",
          &Counters::overruns_by_late_wake_up},
      Row{"overruns_by_long_compute", "", "overruns caused by the model: a long computation",
          &Counters::overruns_by_long_compute},
      Row{"catch_up_ticks", "", "ticks that started late and ran back to back",
          &Counters::catch_up_ticks},
      Row{"gaps", "", "gaps: intervals in which ticks were skipped", &Counters::gaps, true},
      Row{"skipped_ticks", "", "ticks skipped because the loop had fallen too far behind",
          &Counters::skipped_ticks, true},
      Row{"held_ticks", "", "ticks that held a probe's last sample, because none had arrived",
          &Counters::held_ticks},
      Row{"released_ticks", "", "ticks without contact, because a probe was silent for too long",
          &Counters::released_ticks},
      Row{"releases", "", "outages in which a probe was released", &Counters::releases},
      Row{"spikes", "", "spikes fired", &Counters::spikes},
      Row{"neuron_resets", "", "neurons reset after a non-finite state", &Counters::neuron_resets,
          true},
      Row{"spikes_refused", "", "spikes lost: a neuron fired more than once in a millisecond",
          &Counters::spikes_refused, true},
      Row{"samples", "", "samples delivered by all probes", &Counters::samples},
      Row{"samples_late", "", "samples that arrived after their time was simulated",
          &Counters::samples_late, true},
      Row{"samples_dropped", "", "samples dropped: the loop's queue was full",
          &Counters::samples_dropped, true},
      Row{"spikes_dropped", "", "spikes dropped: the queue of a sink was full",
          &Counters::spikes_dropped, true},
      Row{"events_dropped", "", "events dropped: the queue to the report was full",
          &Counters::events_dropped, true},
      Row{"timings_dropped", "", "tick timings dropped: their queue was full",
          &Counters::timings_dropped},
      Row{"demotions", "", "1 if the loop was demoted to SCHED_OTHER: it used too much processor",
          &Counters::demotions, true},
      Row{"commands", "", "stimulation commands", &Counters::commands},
      Row{"commands_limited", "", "number of times that a stimulation limit took effect",
          &Counters::commands_limited},
      Row{"commands_rounded", "", "stimulation commands rounded down to a step of the stimulator",
          &Counters::commands_rounded},
      Row{"largest_rounding_nA", "nA", "most that rounding took from an amplitude",
          &Counters::largest_rounding_nA},
      Row{"largest_rounding_mHz", "mHz", "most that rounding took from a frequency",
          &Counters::largest_rounding_mHz},
      Row{"commands_dropped", "", "stimulation commands dropped: the queue of a sink was full",
          &Counters::commands_dropped, true},
      Row{"stimulation_stops", "", "number of times that a fault switched stimulation off",
          &Counters::stimulation_stops, true},
      Row{"commands_withheld", "", "stimulation commands too late to be sent",
          &Counters::commands_withheld},
      Row{"commands_slowed", "", "amplitudes reduced to the slope in wall time",
          &Counters::commands_slowed},
      Row{"stale_stops", "", "times that the watchdog switched stimulation off",
          &Counters::stale_stops, true},
      Row{"commands_refused", "",
          "stimulation commands that a sink did not pass on: it or its receiver was late or away",
          &Counters::commands_refused, true},
      Row{"probe_count", "", "probes of the scene", &Counters::probe_count},
      Row{"probes_ended", "", "probes whose stream has ended", &Counters::probes_ended},
  };
  std::array<Row, kOwn.size() + kDeviceCounterFields<Cell>.size()> all{};
  std::copy(kOwn.begin(), kOwn.end(), all.begin());
  std::transform(kDeviceCounterFields<Cell>.begin(), kDeviceCounterFields<Cell>.end(),
                 all.begin() + kOwn.size(), [](const auto& of) {
                   return Row{of.name, of.unit, of.meaning, of.cell, of.fault, of.largest};
                 });
  return all;
}();

static_assert(sizeof(RunCounters) == kRunCounterFields<>.size() * sizeof(std::uint64_t),
              "every counter has its row in the table");

}  // namespace merkel
