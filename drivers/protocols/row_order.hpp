#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <utility>

#include "drivers/protocols/clock_order.hpp"
#include "drivers/protocols/sequence_counter.hpp"

namespace merkel {

/// Follows the counter and the clock in the rows of a device: what was lost, and whether the device
/// has restarted.
class RowOrder {
 public:
  using Time = std::chrono::nanoseconds;

  explicit RowOrder(unsigned sequence_bits) noexcept : sequence_(sequence_bits) {}

  void reopened() noexcept { sequence_.reopened(); }
  void forget() noexcept { sequence_.forget(); }
  /// A header has come: the device may have restarted.
  void header() noexcept { header_ = true; }

  /// Sets what a reading says about the readings before it. \param number  its counter, if it has
  /// one. \param wrap  of the clock. \return false if the reading is repeated or late: drop it
  bool take(DeviceReading& reading, std::optional<std::uint32_t> number, std::optional<Time> wrap,
            DeviceStream& stream) {
    const auto& time = reading.device_time;
    if (goes_back(time, number) || (time && clock_.restarted(*time, reading.arrival, wrap))) {
      restarted_ = true;
    }
    if (restarted_) {
      sequence_.forget();
      clock_.forget();
    }
    reading.rebooted = std::exchange(restarted_, false);
    if (!number) return true;
    const auto step = sequence_.next(*number, stream);
    if (step.dropped()) {
      restarted_ = reading.rebooted;
      return false;
    }
    reading.lost = step.lost;
    reading.rebooted = reading.rebooted || step.restarted;
    return true;
  }

 private:
  static constexpr Time kNoise{2'000'000};  ///< largest step back that is not a restart

  /// True if the clock or the counter goes back behind a header: the device has restarted.
  bool goes_back(std::optional<Time> time, std::optional<std::uint32_t> number) noexcept {
    const bool back =
        time && time_ ? *time < *time_ - kNoise : (number && number_ && *number < *number_);
    time_ = time;
    number_ = number;
    return std::exchange(header_, false) && back;
  }

  SequenceCounter sequence_;
  ClockOrder clock_{kNoise};
  bool header_ = false;
  bool restarted_ = false;
  std::optional<Time> time_;             ///< of the last reading
  std::optional<std::uint32_t> number_;  ///< of the last reading
};

}  // namespace merkel
