#pragma once

#include <chrono>
#include <optional>

namespace merkel {

/// Recognises a restart by a device's clock: its times have gone back, and three records in a row
/// go on from there. A wrong time, or a clock that runs at a wrong rate or backwards, is no
/// restart.
class ClockOrder {
 public:
  using Time = std::chrono::nanoseconds;

  /// \param noise  largest step back between two records of the same run
  explicit ClockOrder(Time noise) noexcept : noise_(noise) {}

  /// The clock goes on anywhere.
  void forget() noexcept {
    last_.reset();
    run_ = 0;
  }

  /// \param time  as on the wire; \param wrap  period after which the clock wraps to 0, if it does
  /// \return true at the record that confirms a restart
  bool restarted(Time time, Time arrival, std::optional<Time> wrap) noexcept {
    const Record now{time, arrival};
    if (!last_ || goes_on(now, *last_, wrap)) {
      last_ = now;
      run_ = 0;
      return false;
    }
    run_ = run_ > 0 && goes_on(now, suspect_, wrap) ? run_ + 1 : 1;
    suspect_ = now;
    if (run_ < kPersistence) return false;
    const bool back = time < last_->time;
    last_ = now;
    run_ = 0;
    return back;
  }

 private:
  struct Record {
    Time time{0};
    Time arrival{0};
  };
  static constexpr int kPersistence = 3;
  static constexpr std::chrono::seconds kFarAhead{2};  ///< largest step that need not persist

  [[nodiscard]] bool goes_on(const Record& now, const Record& before,
                             std::optional<Time> wrap) const noexcept {
    Time ahead = now.time - before.time;
    if (wrap && ahead < -*wrap / 2) ahead += *wrap;
    return ahead >= -noise_ && ahead <= now.arrival - before.arrival + kFarAhead;
  }

  Time noise_;
  std::optional<Record> last_;
  Record suspect_;
  int run_ = 0;
};

}  // namespace merkel
