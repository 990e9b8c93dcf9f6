#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <span>
#include <vector>

#include "core/records/raw_frame.hpp"
#include "drivers/probe.hpp"
#include "drivers/protocols/protocol.hpp"

namespace merkel {

/// Sends the bytes of a device's port to listeners. The bytes of the opening (units, rate) are kept
/// for the first listener. If they fill the buffer before one comes, they are dropped and the log
/// stays idle.
class PortLog {
 public:
  /// Adds a listener, from the opening on if its bytes are still kept. Thread: any.
  void add(PortListener& listener);
  /// Removes a listener; it is not called after the return. Thread: any.
  void remove(PortListener& listener);

  /// Thread of the following calls: the port's reader.
  void opened(std::chrono::nanoseconds time);
  void started(std::chrono::nanoseconds time, const ProtocolCounts& counts);
  /// \param counts  the parser's counts after these bytes
  void received(std::span<const std::uint8_t> bytes, std::chrono::nanoseconds arrival,
                const ProtocolCounts& counts);
  void sent(std::span<const std::uint8_t> bytes, std::chrono::nanoseconds time);

 private:
  [[nodiscard]] bool idle() const noexcept { return idle_.load(std::memory_order_acquire); }
  void notify(RawFrame frame, std::span<const std::uint8_t> bytes);
  void notify(const RawFrame& frame);

  std::atomic<bool> idle_{false};  ///< no listener, and nothing is kept
  ProtocolCounts
      reported_;  ///< counts when the last frame was sent to listeners; for the port's reader only
  std::mutex mutex_;  ///< guards the rest
  std::vector<PortListener*> listeners_;
  std::vector<RawFrame> opening_;
  std::uint64_t dropped_ = 0;  ///< frames that were not kept
};

}  // namespace merkel
