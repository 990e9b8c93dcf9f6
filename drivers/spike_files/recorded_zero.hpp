#pragma once

#include <charconv>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string_view>

#include "drivers/spike_files/spike_file.hpp"

namespace merkel {

/// What a file notes of the zero of its times (TimeBase::facts()): turns them into times from the
/// start of the run.
class RecordedZero {
 public:
  /// Takes a name and its value, if it is of use.
  void take(std::string_view name, std::string_view value) {
    if (name == "time_offset_ns") offset_ = whole(value);
    if (name == "start_device_ns") start_ = whole(value);
  }
  void apply(SpikeFile& file) const {
    if (!offset_ || !start_) return;
    file.from_start = true;
    for (RecordedSpike& spike : file.spikes) spike.time += *offset_ - *start_;
  }

 private:
  static std::optional<std::chrono::nanoseconds> whole(std::string_view text) {
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    constexpr std::int64_t kMost = 4'000'000'000'000'000'000;  // whose differences fit
    if (error != std::errc{} || end != text.data() + text.size() || value > kMost / 2 ||
        value < -kMost / 2) {
      return std::nullopt;
    }
    return std::chrono::nanoseconds{value};
  }

  std::optional<std::chrono::nanoseconds> offset_;
  std::optional<std::chrono::nanoseconds> start_;
};

}  // namespace merkel
