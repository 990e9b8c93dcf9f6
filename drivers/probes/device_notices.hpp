#pragma once

#include <chrono>
#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

namespace merkel {

/// Sentences about a device on their way to the user. They may hold the device's own words, so they
/// are made printable, and no more than a few pass in a second: the rest is counted, and the count
/// is passed on. Thread: any.
class DeviceNotices {
 public:
  /// \param now  on any monotonic clock
  void add(const std::string& sentence, std::chrono::nanoseconds now);
  /// So many sentences were left out before they came here.
  void left_out(std::uint64_t count);
  /// Those since the last call.
  [[nodiscard]] std::vector<std::string> take();

 private:
  static constexpr std::uint32_t kPerSecond = 5;
  static constexpr std::size_t kMost = 64;

  std::mutex mutex_;  ///< guards all
  std::vector<std::string> sentences_;
  std::chrono::nanoseconds second_{0};  ///< when the present one began
  std::uint32_t passed_ = 0;            ///< in it
  std::uint64_t left_out_ = 0;
};

}  // namespace merkel
