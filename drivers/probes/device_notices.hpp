#pragma once

#include <chrono>
#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

namespace merkel {

/// Messages about a device for the user. They may quote the device, so they are made printable.
/// Only a few per second pass; the others are counted, and the count is passed on. Thread: any.
class DeviceNotices {
 public:
  /// \param now  time on any monotonic clock
  void add(const std::string& sentence, std::chrono::nanoseconds now);
  /// Adds to the number of suppressed messages.
  void dropped(std::uint64_t count);
  /// The messages since the last call.
  [[nodiscard]] std::vector<std::string> take();

 private:
  static constexpr std::uint32_t kPerSecond = 5;
  static constexpr std::size_t kMax = 64;

  std::mutex mutex_;  ///< guards all
  std::vector<std::string> sentences_;
  std::chrono::nanoseconds second_{0};  ///< start of the current second
  std::uint32_t passed_ = 0;            ///< in the current second
  std::uint64_t dropped_ = 0;
};

}  // namespace merkel
