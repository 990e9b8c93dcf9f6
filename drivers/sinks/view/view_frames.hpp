#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "core/contact/sliding_contact.hpp"
#include "core/contact/tip_contact.hpp"
#include "core/records/record_batch.hpp"
#include "drivers/sink_setup.hpp"

namespace merkel {

/// Collects the data between two frames of the live page and encodes it.
///
/// A frame is little-endian, without padding (page/frames.js reads it):
///   u32 number · u32 flags (Flag) · f64 origin_s (probe time of the start) ·
///   f64 from_s, to_s: the time span of the frame, from the start ·
///   u32 n · f64×n counters (kRunCounterFields, page_lost) ·
///   u32 probes · per probe f32 depth_mm, force_mN, x_mm, y_mm, contact_radius_mm, gauge_depth_mm
///     (as the probe measured it; 0: it does not), tip_x_mm, tip_y_mm, u32 state (bits 0 and 1:
///     TickRecord::State, 6: zero uncertain, 7: touches; RunControl::Link above the low byte), u32
///     taxels · f32×taxels kPa ·
///   u32 points · per point f32 seconds before to_s, u32 states (two bits a probe: the worst
///     TickRecord::State since the last point), per probe f32 depth_mm (of a tactile
///     array, its highest pressure, kPa), force_mN ·
///   u32 spikes · per spike f32 seconds before to_s, u32 neuron ·
///   u32 n · u32×n ticks by time from the touch to its spikes, from 1 µs up,
///     8 bins per decade ·
///   u32 watched · per neuron u32 number, u32 samples, per sample f32 seconds before to_s, drive,
///     potential ·
///   u32 electrodes · per electrode f32 amplitude_uA, f32 frequency_Hz, u32 stop
///     (StimulationCommand::Stop), u32 pulses since the last frame ·
///   u32 length · JSON: [{"kind", "t", …}], single events; empty: none
/// Used by one thread.
class ViewFrames {
 public:
  static constexpr std::size_t kLatencyBins = 40;
  enum Flag : std::uint32_t {
    kOver = 1U << 0U,       ///< the run has ended
    kDiscard = 1U << 1U,    ///< time has jumped: discard earlier data
    kRecording = 1U << 2U,  ///< a session is being recorded on request
    kStill = 1U << 3U,      ///< a paused replay
    kStopped = 1U << 4U,    ///< stimulation is stopped by hand
  };

  explicit ViewFrames(const SinkSetup& setup);

  void add(const RecordBatch& batch);
  /// Adds a message for the user of the page.
  void add_notice(std::string_view sentence);

  void set_links(const RunControl& control);
  /// Drops the data since the last frame, because time has jumped.
  void forget();

  /// The frame of all data since the last one. \param flags  Flag bits
  [[nodiscard]] std::string take(std::uint32_t flags);

 private:
  struct Probe {
    /// Of a played session, which has no model: computes the presses; else empty.
    std::optional<TipContact> tip;
    std::unique_ptr<SlidingContact> surface;
    Press press;
    std::vector<float> taxels;  ///< pressures of a tactile array, kPa
    ContactInput input;         ///< as the probe measured it
    TickRecord::State state = TickRecord::State::kFollowing;
    TickRecord::State worst = TickRecord::State::kFollowing;  ///< since the last point
    bool touches = false;
    bool zero_uncertain = false;
    RunControl::Link link = RunControl::Link::kRecording;
  };
  struct Spike {
    std::chrono::nanoseconds time;
    std::uint32_t neuron;
  };
  struct Point {
    std::chrono::nanoseconds time;
    std::uint32_t states;
  };

  /// The last command, and pulses since the last frame.
  struct Stimulation {
    double amplitude_uA = 0.0;
    double frequency_Hz = 0.0;
    StimulationCommand::Stop stop = StimulationCommand::Stop::kNone;
    std::uint32_t pulses = 0;
  };

  /// False until the first tick of a run or after a jump. Spikes that arrive before it wait for the
  /// next frame, because their times count from the newest tick.
  [[nodiscard]] bool is_timed() const noexcept { return origin_.has_value() && !jumped_; }
  void add(const SpikeEvent& spike);
  void add(const StimulationCommand& command);
  void add(const TickRecord& tick);
  void add(const TaxelBlock& block);
  void add(const LoopEvent& event);
  void add(const NeuronSample& sample);
  void add(const Mark& mark);
  void add(const SyncEdge& edge);
  void add_point(std::chrono::nanoseconds time);
  void add_news(const nlohmann::json& event);
  [[nodiscard]] double since_start_s(std::chrono::nanoseconds time) const;
  void append_counters(std::string& bytes) const;
  void append_probes(std::string& bytes) const;
  void append_points(std::string& bytes) const;
  void append_spikes(std::string& bytes) const;
  void append_watched(std::string& bytes) const;
  void append_electrodes(std::string& bytes) const;

  std::chrono::nanoseconds tick_;
  std::vector<Probe> probes_;
  std::optional<std::chrono::nanoseconds> start_;  ///< of a played session
  std::optional<std::chrono::nanoseconds> origin_;
  std::chrono::nanoseconds newest_{0};
  std::chrono::nanoseconds sent_{0};  ///< end of the last frame
  std::chrono::nanoseconds next_point_{0};
  std::vector<Point> points_;
  std::vector<float> point_values_;  ///< per point and probe: depth or pressure, force
  std::vector<Spike> spikes_;
  std::vector<NeuronSample> watched_;
  std::vector<Stimulation> electrodes_;
  std::string news_;
  std::array<std::uint32_t, kLatencyBins> latency_{};
  std::uint64_t skipped_ = 0;  ///< spikes and points that did not fit into a frame
  RunStatus status_;
  std::uint32_t number_ = 0;
  bool jumped_ = false;  ///< the next tick does not follow the last
};

}  // namespace merkel
