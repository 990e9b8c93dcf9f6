#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include "core/records/given_drive.hpp"
#include "core/records/loop_event.hpp"
#include "core/records/mark.hpp"
#include "core/records/neuron_sample.hpp"
#include "core/records/probe_sample.hpp"
#include "core/records/raw_frame.hpp"
#include "core/records/run_status.hpp"
#include "core/records/sent_command.hpp"
#include "core/records/spike_event.hpp"
#include "core/records/stimulation_command.hpp"
#include "core/records/sync_edge.hpp"
#include "core/records/taxel_block.hpp"
#include "core/records/tick_record.hpp"

namespace merkel {

/// A sample as a probe delivered it.
struct DeliveredSample {
  std::uint32_t probe = 0;  ///< from 0
  ProbeSample sample;
  std::vector<double> further{};  ///< its further columns: ProbeInfo::extra_columns
};

/// Bytes that passed a port of a probe.
struct PortFrame {
  std::uint32_t probe = 0;  ///< from 0
  std::uint32_t port = 0;   ///< below Probe::ports()
  RawFrame frame;
};

/// All kinds of record of a run, a list of each: the only table of the kinds. Each list is in order
/// of time. Receivers take the lists in this order.
template <template <class> class List>
struct RecordLists {
  List<PortFrame> frames{};             ///< the bytes that pass the devices' ports
  List<DeliveredSample> samples{};      ///< calibrated samples as the probes delivered them
  List<SyncEdge> edges{};               ///< of the devices' sync lines; those of a device in order
  List<TaxelZeros> zeros{};             ///< of tactile arrays that changed at a reading
  List<GivenDrive> drives{};            ///< of electrodes with an encoder of the user's own
  List<SpikeEvent> spikes{};            ///< ties by patch and neuron
  List<StimulationCommand> commands{};  ///< the last update of a run has every electrode off
  List<SentCommand> sent{};             ///< commands that have passed the gate, for receivers
  List<TaxelBlock> taxels{};            ///< pressures of tactile arrays that changed at a tick
  List<TickRecord> ticks{};             ///< the input of the loop: each probe at each tick
  List<LoopEvent> events{};             ///< releases, gaps, resets
  List<NeuronSample> neurons{};         ///< drive and potential of the watched neurons
  List<Mark> marks{};                   ///< instants marked by the user
  List<RunStatus> status{};             ///< the run's counters, five times a second and at the end

  /// work(list of each kind…), in order. (With a tuple, sources took up to a third more time to
  /// compile.)
  template <class Self, class Work>
  static constexpr auto with_all(Self& self, const Work& work) {
    return work(self.frames, self.samples, self.edges, self.zeros, self.drives, self.spikes,
                self.commands, self.sent, self.taxels, self.ticks, self.events, self.neurons,
                self.marks, self.status);
  }
  /// The list of a kind.
  template <class Record>
  [[nodiscard]] constexpr List<Record>& of() noexcept {
    return *chosen<List<Record>>(*this);
  }
  template <class Record>
  [[nodiscard]] constexpr const List<Record>& of() const noexcept {
    return *chosen<const List<Record>>(*this);
  }

 private:
  template <class Wanted, class Self>
  static constexpr Wanted* chosen(Self& self) noexcept {
    struct IfWanted {
      static constexpr Wanted* of(Wanted* list) { return list; }
      static constexpr Wanted* of(const volatile void* /*other*/) { return nullptr; }
    };
    return with_all(self, [](auto&... lists) {
      Wanted* found = nullptr;
      ((found = found != nullptr ? found : IfWanted::of(&lists)), ...);
      return found;
    });
  }
};

/// Calls work(list) for the list of each kind, in order.
template <class Lists, class Work>
constexpr void for_each_kind(Lists&& lists, const Work& work) {
  std::remove_cvref_t<Lists>::with_all(lists, [&](auto&... each) { (work(each), ...); });
}

template <class Record>
using RecordSpan = std::span<const Record>;
template <class Record>
using RecordVector = std::vector<Record>;

/// Records that are handed on: spans, valid during the call.
using RecordBatch = RecordLists<RecordSpan>;

/// The records of all lists together.
template <class Lists>
[[nodiscard]] constexpr std::size_t count_of(const Lists& lists) {
  std::size_t count = 0;
  for_each_kind(lists, [&](const auto& list) { count += list.size(); });
  return count;
}

template <class Lists>
void clear_all(Lists& lists) {
  for_each_kind(lists, [](auto& list) { list.clear(); });
}

/// The records of vectors. They keep owning them.
[[nodiscard]] RecordBatch batch_of(const RecordLists<RecordVector>& lists);

template <class Record>
struct RecordKind {};
inline constexpr RecordLists<RecordKind> kAllKinds{};

/// A bit for each kind.
template <class Record>
inline constexpr std::uint32_t kKind =
    RecordLists<RecordKind>::with_all(kAllKinds, [](const auto&... kinds) {
      std::uint32_t bit = 1;
      std::uint32_t found = 0;
      ((found |= std::is_same_v<decltype(kinds), const RecordKind<Record>&> ? bit : 0U, bit <<= 1U),
       ...);
      return found;
    });

/// The bits of several kinds.
template <class... Records>
inline constexpr std::uint32_t kKinds = (kKind<Records> | ...);

/// \see SentCommand::command
[[nodiscard]] constexpr std::chrono::nanoseconds time_of(const SentCommand& item) noexcept {
  return item.command.time;
}
/// The probe time of a record.
template <class Record>
[[nodiscard]] constexpr std::chrono::nanoseconds time_of(const Record& record) noexcept {
  return record.time;
}
[[nodiscard]] constexpr std::chrono::nanoseconds time_of(const DeliveredSample& item) noexcept {
  return item.sample.time;
}
/// Of a frame: the time of the host.
[[nodiscard]] constexpr std::chrono::nanoseconds time_of(const PortFrame& item) noexcept {
  return item.frame.time;
}

}  // namespace merkel
