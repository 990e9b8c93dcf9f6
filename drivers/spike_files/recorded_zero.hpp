#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/files/input_file.hpp"
#include "drivers/parsed_number.hpp"

namespace merkel {

/// The value of the last line NAME = VALUE of a text: what a file says of itself follows the facts
/// of its session.
[[nodiscard]] inline std::optional<std::string> noted_value(const std::string& text,
                                                            const std::string& name) {
  const std::string lines = "\n" + text;
  const std::string wanted = "\n" + name + " = ";
  const auto place = lines.rfind(wanted);
  if (place == std::string::npos) return std::nullopt;
  const auto begin = place + wanted.size();
  return lines.substr(begin, lines.find('\n', begin) - begin);
}

/// The zero of a file's times, as TimeBase::facts() describes it. Converts them to times from the
/// start of the run.
class RecordedZero {
 public:
  static constexpr std::array kNames = {"time_offset_ns", "start_device_ns"};

  /// Uses the file NAME.time beside a text file, if there is one.
  void take_file_beside(const std::string& path) {
    take_all(read_whole_file(path + ".time", "zero of the times", kMaxBytes).value_or(""));
  }
  /// Uses a fact if it describes the zero.
  void take(std::string_view name, std::string_view value) {
    if (name == "time_offset_ns") offset_ = whole(value);
    if (name == "start_device_ns") start_ = whole(value);
  }
  /// Uses lines NAME = VALUE.
  void take_all(const std::string& text) {
    for (const char* const name : kNames) {
      if (const auto value = noted_value(text, name)) take(name, *value);
    }
  }
  /// False if the file does not describe its zero; the times are then unchanged.
  template <class Item>
  [[nodiscard]] bool apply(std::vector<Item>& items) const {
    if (!offset_ || !start_) return false;
    for (Item& item : items) item.time += *offset_ - *start_;
    return true;
  }

 private:
  static constexpr std::size_t kMaxBytes = 4096;

  static std::optional<std::chrono::nanoseconds> whole(std::string_view text) {
    constexpr std::int64_t kMax = 4'000'000'000'000'000'000;  // whose differences fit
    const auto value = parsed_number<std::int64_t>(text);
    if (!value || *value > kMax / 2 || *value < -kMax / 2) return std::nullopt;
    return std::chrono::nanoseconds{*value};
  }

  std::optional<std::chrono::nanoseconds> offset_;
  std::optional<std::chrono::nanoseconds> start_;
};

}  // namespace merkel
