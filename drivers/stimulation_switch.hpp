#pragma once

#include <atomic>
#include <cstdint>
#include <string_view>

namespace merkel {

/// Stops the stimulation of a run by hand. A stop holds until start(); the gate of the commands
/// (StimulationGate) asks for it about once a millisecond, whatever the simulation does.
/// Thread: any; also a signal handler.
class StimulationSwitch {
 public:
  enum class By : std::uint8_t { kNone, kSignal, kPage, kProgram, kTerminal };

  /// The first stop counts.
  void stop(By by) noexcept {
    By none = By::kNone;
    by_.compare_exchange_strong(none, by);
  }
  /// Commands go on from 0, within the limits.
  void start() noexcept { by_.store(By::kNone); }
  /// kNone: it is not stopped.
  [[nodiscard]] By stopped() const noexcept { return by_.load(std::memory_order_relaxed); }

 private:
  std::atomic<By> by_{By::kNone};
  static_assert(std::atomic<By>::is_always_lock_free, "a signal handler stores it");
};

/// "SIGUSR1", "the live page", "the program", "the terminal".
[[nodiscard]] constexpr std::string_view name_of(StimulationSwitch::By by) noexcept {
  switch (by) {
    case StimulationSwitch::By::kNone:
      return "";
    case StimulationSwitch::By::kSignal:
      return "SIGUSR1";
    case StimulationSwitch::By::kPage:
      return "the live page";
    case StimulationSwitch::By::kProgram:
      return "the program";
    case StimulationSwitch::By::kTerminal:
      return "the terminal";
  }
  return "";
}

}  // namespace merkel
