#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/realtime_tag.hpp"
#include "core/records/stimulation_command.hpp"

namespace merkel {

/// The last stage before commands leave: whatever comes in, nothing above a limit goes out.
///
/// In order: values that are not finite or are negative switch the electrode off; amplitude, charge
/// and frequency are clipped; an amplitude rises no faster than the slope; the weakest of too many
/// simultaneous electrodes are switched off; a total above the budget scales all by one factor.
/// Pulses of one tick count as simultaneous, because they are sent together. Real-time: yes, after
/// construction. Deterministic.
class StimulationLimiter {
 public:
  static constexpr double kNone = std::numeric_limits<double>::infinity();
  struct Limits {
    std::chrono::nanoseconds phase{200'000};
    double max_charge_nC = 0.0;  ///< of a phase
    double max_total_uA = 0.0;   ///< of all electrodes
    double max_slope_uA_per_s = kNone;
    std::size_t max_electrodes = std::numeric_limits<std::size_t>::max();
  };
  struct OfElectrode {
    double max_uA = 0.0;
    double max_Hz = 0.0;
  };
  /// How often each limit took effect.
  struct Clippings {
    std::uint64_t invalid = 0;  ///< commands that were not finite, or negative
    std::uint64_t amplitude = 0;
    std::uint64_t charge = 0;
    std::uint64_t frequency = 0;  ///< of pulses: those left out because they came too soon
    std::uint64_t slope = 0;
    std::uint64_t electrodes = 0;  ///< commands switched off, pulses left out
    std::uint64_t total = 0;       ///< updates, and ticks with pulses, that were scaled

    [[nodiscard]] std::uint64_t all() const noexcept {
      return invalid + amplitude + charge + frequency + slope + electrodes + total;
    }
    friend bool operator==(const Clippings&, const Clippings&) = default;
  };

  StimulationLimiter(const Limits& limits, std::vector<OfElectrode> electrodes);

  /// All electrodes are off at `time`.
  void reset(std::chrono::nanoseconds time) noexcept MERKEL_REALTIME;

  /// Limits an update in place. \param update  a command for each electrode, in order, of one time
  void limit_update(std::span<StimulationCommand> update) noexcept MERKEL_REALTIME;

  /// Limits the pulses of one tick in place and moves those that may leave to the front.
  /// \param pulses  in order of time.  \param tick_begin  earlier than all of them
  /// \return how many may leave
  [[nodiscard]] std::size_t limit_pulses(std::span<StimulationCommand> pulses,
                                         std::chrono::nanoseconds tick_begin) noexcept
      MERKEL_REALTIME;

  [[nodiscard]] const Clippings& clippings() const noexcept { return clippings_; }

 private:
  /// What an electrode has put out.
  struct Output {
    double train_uA = 0.0;  ///< of the last update
    double pulse_uA = 0.0;  ///< of the last pulse
    std::chrono::nanoseconds pulse_time{0};
    bool pulsed = false;                    ///< there has been a pulse
    double rise_from_uA = 0.0;              ///< of the last pulse; 0 from a stop on
    std::chrono::nanoseconds rise_time{0};  ///< of that pulse or stop
    double wanted_uA = 0.0;                 ///< strongest pulse since the last update, unscaled
    double tick_uA = 0.0;                   ///< strongest pulse of the tick being limited
  };

  void limit_command(StimulationCommand& command) noexcept;
  void limit_rise(double& amplitude_uA, double from_uA, std::chrono::nanoseconds elapsed) noexcept;
  void keep_strongest(std::span<StimulationCommand> update, std::size_t allowed) noexcept;
  void scale_update(std::span<StimulationCommand> update, double alive_uA) noexcept;
  [[nodiscard]] std::size_t scale_pulses(std::span<StimulationCommand> pulses,
                                         double used_uA) noexcept;
  [[nodiscard]] bool alive(const Output& output, std::chrono::nanoseconds time) const noexcept;

  Limits limits_;
  std::vector<OfElectrode> electrodes_;
  double charge_uA_;                                ///< largest amplitude within the charge
  double budget_uA_;                                ///< that scaled totals keep to
  std::vector<std::chrono::nanoseconds> interval_;  ///< least, between pulses of an electrode
  std::vector<Output> outputs_;
  std::vector<std::size_t> order_;  ///< scratch
  std::chrono::nanoseconds last_update_{0};
  Clippings clippings_;
};

}  // namespace merkel
