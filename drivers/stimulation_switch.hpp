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

  struct alignas(std::uint32_t) State {  // aligned as one word, so that it is lock-free
    By by = By::kNone;                   ///< kNone: it is not stopped
    By last = By::kNone;                 ///< of the last stop
    std::uint16_t stops = 0;             ///< so far, modulo 2^16: tells of a stop that is over
  };

  /// The first stop counts.
  void stop(By by) noexcept {
    State state = state_.load();
    State stopped;
    do {
      if (state.by != By::kNone) return;
      stopped = {by, by, static_cast<std::uint16_t>(state.stops + 1)};
    } while (!state_.compare_exchange_weak(state, stopped));
  }
  /// Commands go on from 0, within the limits.
  void start() noexcept {
    State state = state_.load();
    while (!state_.compare_exchange_weak(state, {By::kNone, state.last, state.stops})) {
    }
  }
  [[nodiscard]] State state() const noexcept { return state_.load(); }
  /// kNone: it is not stopped.
  [[nodiscard]] By stopped() const noexcept { return state().by; }

 private:
  std::atomic<State> state_{State{}};
  static_assert(std::atomic<State>::is_always_lock_free, "a signal handler stores it");
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
