#pragma once

#include <chrono>
#include <type_traits>

namespace merkel {

/// The stages of a tick with spikes, as host-monotonic times except `end`.
struct TickTiming {
  std::chrono::nanoseconds end{0};        ///< probe time; its spikes are at most a tick older
  std::chrono::nanoseconds arrival{0};    ///< at the host, of the last sample at or before the end
  std::chrono::nanoseconds due{0};        ///< scheduled start
  std::chrono::nanoseconds started{0};    ///< actual start
  std::chrono::nanoseconds computed{0};   ///< end of the steps of model and encoder
  std::chrono::nanoseconds published{0};  ///< its spikes are in the consumers' queues
};

static_assert(std::is_trivially_copyable_v<TickTiming>);

}  // namespace merkel
