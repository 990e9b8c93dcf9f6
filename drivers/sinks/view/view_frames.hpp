#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/contact/tip_contact.hpp"
#include "core/records/run_status.hpp"
#include "core/records/spike_event.hpp"
#include "core/records/tick_record.hpp"
#include "drivers/sinks/sink_setup.hpp"

namespace merkel {

/// Gathers what happens between two frames of the live page, and writes it as bytes.
///
/// A frame is little-endian, without padding (page.js reads it):
///   u32 number · u32 flags (1: the run is over) · f64 time_s of the newest tick ·
///   u32 n · f64×n counters (kCounters) ·
///   u32 probes · per probe f32 depth_mm, force_mN, x_mm, y_mm, contact_radius_mm, u32 state ·
///   u32 points · per point f32 seconds before time_s, then per probe f32 depth_mm, force_mN ·
///   u32 spikes · per spike f32 seconds before time_s, u32 neuron ·
///   u32 n · u32×n ticks of a latency from 1 µs up, 8 bins a decade
/// Times are from the first tick on.
class ViewFrames {
 public:
  static constexpr std::size_t kLatencyBins = 40;
  /// What the counters of a frame are, in order.
  static constexpr std::array<std::string_view, 17> kCounters = {
      "spikes",         "ticks",          "overruns",        "longest_overrun_ms",
      "catch_up_ticks", "gaps",           "skipped_ticks",   "neuron_resets",
      "samples",        "samples_late",   "samples_dropped", "held_ticks",
      "released_ticks", "spikes_dropped", "page_lost",       "probes",
      "probes_ended"};

  explicit ViewFrames(const SinkSetup& setup);

  void add(std::span<const SpikeEvent> spikes);
  void add(std::span<const TickRecord> ticks);
  void set(const RunStatus& status) { status_ = status; }

  /// The frame of everything added since the last. \param over  whether the run has ended
  [[nodiscard]] std::string take(bool over);

  /// What stays the same during a run: scene, patch, receptors, probes, parameters. JSON.
  [[nodiscard]] std::string hello() const;

 private:
  struct Probe {
    TipContact tip;
    Press press;
    TickRecord::State state = TickRecord::State::kFollowing;
  };
  struct Spike {
    std::chrono::nanoseconds time;
    std::uint32_t neuron;
  };

  NeuronNumbering numbering_;
  RunDescription run_;
  std::vector<Probe> probes_;
  std::optional<std::chrono::nanoseconds> origin_;
  std::chrono::nanoseconds newest_{0};
  std::chrono::nanoseconds next_point_{0};
  std::vector<std::chrono::nanoseconds> point_times_;
  std::vector<float> point_values_;  ///< per point and probe: depth, force
  std::vector<Spike> spikes_;
  std::array<std::uint32_t, kLatencyBins> latency_{};
  std::uint64_t all_spikes_ = 0;
  std::uint64_t held_ticks_ = 0;
  std::uint64_t released_ticks_ = 0;
  std::uint64_t late_ = 0;
  std::uint64_t left_out_ = 0;  ///< spikes and points beyond what a frame takes
  RunStatus status_;
  std::uint32_t number_ = 0;
};

}  // namespace merkel
