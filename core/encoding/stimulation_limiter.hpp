#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "core/encoding/charge_window.hpp"
#include "core/realtime_tag.hpp"
#include "core/records/stimulation_command.hpp"

namespace merkel {

/// The last stage before commands leave: no output exceeds a limit, whatever the input.
///
/// In order: negative and non-finite values switch the electrode off; amplitude, charge and
/// frequency are clipped; an amplitude rises no faster than the slope; if too many electrodes are
/// active at once, the weakest are switched off; if the total exceeds the budget, all amplitudes
/// are scaled by one factor. Pulses of one tick count as simultaneous, because they are sent
/// together. A pulse of a group is dropped if another of the group is too close, or if the charge
/// of the last second does not allow it. Real-time: yes, after construction. Deterministic.
class StimulationLimiter {
 public:
  static constexpr double kNone = std::numeric_limits<double>::infinity();
  static constexpr std::size_t kNoGroup = std::numeric_limits<std::size_t>::max();
  /// Electrodes that pulse in turn.
  struct OfGroup {
    std::chrono::nanoseconds gap{0};     ///< shortest between two pulses of the group
    double max_charge_nC_per_s = kNone;  ///< of one phase of each pulse, in any second
  };
  struct Limits {
    double max_total_uA = 0.0;  ///< sum over all electrodes
    std::size_t max_electrodes = std::numeric_limits<std::size_t>::max();
    std::vector<OfGroup> groups;
  };
  struct OfElectrode {
    double max_uA = 0.0;
    double max_Hz = 0.0;
    std::chrono::nanoseconds phase{200'000};
    double max_charge_nC = kNone;  ///< per phase
    double max_slope_uA_per_s = kNone;
    std::chrono::nanoseconds pulse{400'000};  ///< both phases and the time between them
    std::size_t group = kNoGroup;             ///< number in Limits::groups
  };
  /// How often each limit took effect.
  struct Clippings {
    std::uint64_t invalid = 0;  ///< negative or non-finite commands
    std::uint64_t amplitude = 0;
    std::uint64_t charge = 0;
    std::uint64_t frequency = 0;  ///< also pulses dropped because they came too soon
    std::uint64_t slope = 0;
    std::uint64_t electrodes = 0;  ///< commands switched off, pulses dropped
    std::uint64_t group = 0;       ///< pulses dropped because of their group
    std::uint64_t total = 0;       ///< scaled updates, and scaled ticks with pulses

    [[nodiscard]] std::uint64_t all() const noexcept {
      return invalid + amplitude + charge + frequency + slope + electrodes + group + total;
    }
    friend bool operator==(const Clippings&, const Clippings&) = default;
  };

  StimulationLimiter(const Limits& limits, std::vector<OfElectrode> electrodes);

  /// All electrodes are off at `time`.
  void reset(std::chrono::nanoseconds time) noexcept MERKEL_REALTIME;

  /// Limits an update in place.
  /// \param update  one command per electrode, in order, at one time
  void limit_update(std::span<StimulationCommand> update) noexcept MERKEL_REALTIME;

  /// Limits the pulses of one tick in place and moves the allowed pulses to the front.
  /// \param pulses  in order of time
  /// \param tick_begin  earlier than all of them
  /// \return the number of allowed pulses
  [[nodiscard]] std::size_t limit_pulses(std::span<StimulationCommand> pulses,
                                         std::chrono::nanoseconds tick_begin) noexcept
      MERKEL_REALTIME;

  [[nodiscard]] const Clippings& clippings() const noexcept { return clippings_; }

 private:
  /// The recent output of an electrode.
  struct Output {
    double train_uA = 0.0;  ///< of the last update
    double pulse_uA = 0.0;  ///< of the last pulse
    std::chrono::nanoseconds pulse_time{0};
    bool pulsed = false;                    ///< there has been at least one pulse
    double rise_from_uA = 0.0;              ///< of the last pulse; 0 after a stop
    std::chrono::nanoseconds rise_time{0};  ///< of that pulse or stop
    double wanted_uA = 0.0;                 ///< strongest pulse since the last update, unscaled
    double tick_uA = 0.0;                   ///< strongest pulse of the tick being limited
  };

  /// The recent output of a group.
  struct Recent {
    ChargeWindow charge;
    std::optional<std::chrono::nanoseconds> pulse;  ///< time of the last
    double wanted_uA = 0.0;  ///< scratch: its strongest pulse since the last update
  };

  void limit_command(StimulationCommand& command) noexcept;
  /// Whether the group of an electrode allows a pulse, which then counts.
  [[nodiscard]] bool group_takes(const StimulationCommand& pulse) noexcept;
  void limit_rise(StimulationCommand& command, double from_uA,
                  std::chrono::nanoseconds elapsed) noexcept;
  void keep_strongest(std::span<StimulationCommand> update, std::size_t allowed) noexcept;
  void scale_update(std::span<StimulationCommand> update, double alive_uA) noexcept;
  [[nodiscard]] std::size_t scale_pulses(std::span<StimulationCommand> pulses,
                                         double used_uA) noexcept;
  /// Whether a pulse of an electrode is in progress.
  [[nodiscard]] bool alive(std::size_t electrode, std::chrono::nanoseconds time) const noexcept;

  Limits limits_;
  std::vector<OfElectrode> electrodes_;
  std::vector<double> charge_uA_;  ///< largest amplitude within the charge limit, by electrode
  double budget_uA_;               ///< limit for scaled totals
  std::vector<std::chrono::nanoseconds>
      interval_;  ///< smallest interval between pulses, by electrode
  std::vector<Output> outputs_;
  std::vector<Recent> recent_;      ///< by group
  std::vector<std::size_t> order_;  ///< scratch
  std::chrono::nanoseconds last_update_{0};
  Clippings clippings_;
};

}  // namespace merkel
