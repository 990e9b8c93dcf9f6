#pragma once

#include <chrono>
#include <type_traits>

namespace merkel {

/// When what happened to a tick that made spikes: host-monotonic times, but for its end.
struct TickTiming {
  std::chrono::nanoseconds end{0};        ///< probe time; its spikes are at most a tick older
  std::chrono::nanoseconds arrival{0};    ///< at the host, of the last sample at or before the end
  std::chrono::nanoseconds due{0};        ///< when it should have started
  std::chrono::nanoseconds started{0};    ///< when it did
  std::chrono::nanoseconds computed{0};   ///< the model's end
  std::chrono::nanoseconds published{0};  ///< its spikes were in the consumers' queues
};

static_assert(std::is_trivially_copyable_v<TickTiming>);

}  // namespace merkel
