#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <span>

#include "core/realtime_tag.hpp"
#include "realtime/input/delay_estimate.hpp"
#include "realtime/input/probe_input.hpp"

namespace merkel {

/// The delay of the loop: follows the slowest device, up and down.
///
/// The delay only moves the instants at which ticks run. It grows by at most half a tick per tick,
/// so that ticks and heartbeats go on while it grows, and shrinks by a fiftieth: then ticks run
/// slightly early, when their samples have arrived. The grid and the samples of each tick stay the
/// same, and so do the spikes. Real-time: yes. Thread: simulation, except where noted.
class DelayControl {
 public:
  using Time = std::chrono::nanoseconds;

  /// What the samples of a device need beyond the ceiling of its delay, ns; 0: nothing. Thread:
  /// any.
  struct Shortage {
    std::atomic<std::int64_t> needed_ns{0};
    std::atomic<std::int64_t> ceiling_ns{0};
  };

  /// \param current   in ns; read and written; other threads may read it
  /// \param shortage  written
  DelayControl(std::atomic<std::int64_t>& current, Shortage& shortage) noexcept
      : current_(current), shortage_(shortage) {}

  /// The delay of the next tick.
  /// \param catches_up  at the start, when no tick is on time: the delay is at once what is needed
  [[nodiscard]] Time step(std::span<ProbeInput> inputs, Time tick,
                          bool catches_up = false) noexcept MERKEL_REALTIME {
    const Time now{current_.load(std::memory_order_relaxed)};
    if (ticks_++ % kLookEvery == 0) look(inputs, now);
    if (target_ == now) return now;
    const Time next = catches_up
                          ? target_
                          : std::clamp(target_, now - tick / kShrinkTicks, now + tick / kGrowTicks);
    current_.store(next.count(), std::memory_order_relaxed);
    return next;
  }

  /// Reports that the host did not run between two instants.
  static void add_stall(std::span<ProbeInput> inputs, Time begin,
                        Time end) noexcept MERKEL_REALTIME {
    for (ProbeInput& input : inputs) {
      if (input.estimate() != nullptr) input.estimate()->add_stall(begin, end);
    }
  }
  /// A later wake-up is a stall of the host.
  static constexpr Time kStall{500'000};

 private:
  static constexpr std::uint64_t kLookEvery = 16;  ///< ticks
  static constexpr int kShrinkTicks = 50;
  static constexpr int kGrowTicks = 2;

  void look(std::span<ProbeInput> inputs, Time now) noexcept {
    Time needed{0};
    Time beyond{0};
    bool known = false;
    for (ProbeInput& input : inputs) {
      if (input.estimate() == nullptr) continue;
      const auto of_probe = input.estimate()->needed();
      known = known || of_probe;
      const Time ceiling = input.estimate()->ceiling();
      // Until enough samples are measured, the delay of the start applies.
      const Time need = of_probe.value_or(std::min(now, ceiling));
      if (need > std::max(ceiling, beyond)) {
        beyond = need;
        shortage_.ceiling_ns.store(ceiling.count(), std::memory_order_relaxed);
      }
      needed = std::max(needed, std::min(need, ceiling));
    }
    shortage_.needed_ns.store(beyond.count(), std::memory_order_relaxed);
    target_ = known ? needed : now;
  }

  std::atomic<std::int64_t>& current_;
  Shortage& shortage_;
  Time target_{0};
  std::uint64_t ticks_ = 0;
};

}  // namespace merkel
