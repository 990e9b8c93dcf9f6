#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/encoding/encoding_parameters.hpp"
#include "core/encoding/stimulation_gate.hpp"
#include "core/records/run_counters.hpp"
#include "drivers/sink.hpp"
#include "realtime/clocks/publish_beat.hpp"
#include "realtime/input/probe_queue.hpp"

namespace merkel {

/// The signs of life of a run, from which its gate decides whether commands may leave. It reads
/// them by itself, so they do not depend on the loop.
class RunWatch {
 public:
  /// \param beat   of the loop's fan-out
  /// \param delay  of the loop in ns
  /// Both borrowed.
  RunWatch(const PublishBeat& beat, const std::atomic<std::int64_t>& delay)
      : beat_(beat), delay_(delay) {}

  /// The parameters of the gate. Call it before the sinks start.
  void guard(const EncodingParameters& encoding, std::chrono::nanoseconds tick,
             std::size_t patches) {
    encoding_ = &encoding;
    tick_ = tick;
    devices_of_patch_.resize(patches);
  }
  /// Adds a device that presses on a patch. Call it before the sinks start.
  void add_device(std::size_t patch, const ProbeQueue& channel) {
    if (patch < devices_of_patch_.size()) devices_of_patch_[patch].push_back(&channel);
  }
  /// Wall time − probe time. Thread: simulation, before the first tick.
  void set_wall_offset(std::chrono::nanoseconds offset) noexcept {
    wall_offset_.store(offset.count(), std::memory_order_relaxed);
  }

  /// What the gate has done so far. Thread: the gate's.
  void count(const StimulationGate::Counts& counts) noexcept {
    withheld_.store(counts.withheld, std::memory_order_relaxed);
    slowed_.store(counts.slowed, std::memory_order_relaxed);
    stale_.store(counts.stale, std::memory_order_relaxed);
  }
  /// Thread: any.
  void add_to(RunCounters& counters) const noexcept {
    counters.commands_withheld = withheld_.load(std::memory_order_relaxed);
    counters.commands_slowed = slowed_.load(std::memory_order_relaxed);
    counters.stale_stops = stale_.load(std::memory_order_relaxed);
  }
  /// Thread: any.
  [[nodiscard]] StimulationSwitch& stimulation() noexcept { return stimulation_; }
  [[nodiscard]] const EncodingParameters& encoding() const noexcept { return *encoding_; }
  [[nodiscard]] StimulationGate make_gate() const { return StimulationGate(*encoding_, tick_); }
  [[nodiscard]] std::size_t patches() const noexcept { return devices_of_patch_.size(); }
  /// The present moment. Thread: any. \param newest  one per patch; filled
  [[nodiscard]] StimulationGate::Moment moment(
      std::span<std::chrono::nanoseconds> newest) const noexcept;

 private:
  const PublishBeat& beat_;
  const std::atomic<std::int64_t>& delay_;
  const EncodingParameters* encoding_ = nullptr;
  std::chrono::nanoseconds tick_{0};
  std::atomic<std::int64_t> wall_offset_{0};
  StimulationSwitch stimulation_;
  std::atomic<std::uint64_t> withheld_{0};
  std::atomic<std::uint64_t> slowed_{0};
  std::atomic<std::uint64_t> stale_{0};
  std::vector<std::vector<const ProbeQueue*>> devices_of_patch_;
};

}  // namespace merkel
