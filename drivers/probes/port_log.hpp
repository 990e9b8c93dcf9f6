#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <span>
#include <vector>

#include "drivers/probe.hpp"
#include "drivers/protocols/protocol.hpp"
#include "drivers/raw_frame.hpp"

namespace merkel {

/// What goes over one port of a device, told to whoever listens. What was said while the device was
/// being opened (its units, its rate) is kept for the first listeners; if none comes before that
/// is full, nothing is kept or told any more, which costs nothing.
class PortLog {
 public:
  /// From now on, or from the opening on if that is still kept. Thread: any.
  void add(PortListener& listener);
  /// It is told nothing any more when this returns. Thread: any.
  void remove(PortListener& listener);

  /// Thread of these: the one that reads the port.
  void opened(std::chrono::nanoseconds time);
  void started(std::chrono::nanoseconds time, const ProtocolCounts& counts);
  /// \param counts  the parser's, after it took the bytes
  void received(std::span<const std::uint8_t> bytes, std::chrono::nanoseconds arrival,
                const ProtocolCounts& counts);
  void sent(std::span<const std::uint8_t> bytes, std::chrono::nanoseconds time);

 private:
  [[nodiscard]] bool idle() const noexcept { return idle_.load(std::memory_order_acquire); }
  void tell(RawFrame frame, std::span<const std::uint8_t> bytes);
  void tell(const RawFrame& frame);

  std::atomic<bool> idle_{false};  ///< nobody listens, and nothing is kept any more
  ProtocolCounts told_;            ///< those at the last frame; of the thread that reads the port
  std::mutex mutex_;               ///< guards the rest
  std::vector<PortListener*> listeners_;
  std::vector<RawFrame> opening_;
  std::uint64_t forgotten_ = 0;  ///< frames that are not kept
};

}  // namespace merkel
