#include "drivers/protocols/frame_lines.hpp"

namespace merkel {
namespace {

constexpr std::size_t kPatienceFrames = 3;  ///< without anything between them

char separator_in(std::string_view line) noexcept {
  for (const char separator : {';', '\t'}) {
    if (line.find(separator) != std::string_view::npos) return separator;
  }
  if (line.find(',') == std::string_view::npos) return ' ';
  // "0,1 0,2" has decimal commas.
  const bool decimal =
      line.find(' ') != std::string_view::npos && line.find(", ") == std::string_view::npos;
  return decimal ? ' ' : ',';
}

}  // namespace

bool is_line_of_numbers(std::string_view line) noexcept {
  return line.find_first_of("0123456789") != std::string_view::npos &&
         line.find_first_not_of("0123456789+-.eE,; \tnaNif") == std::string_view::npos;
}

void FrameLines::reset() noexcept {
  aligned_ = false;
  count_ = before_ = 0;
}

FrameLines::Result FrameLines::take(std::string_view line) {
  if (!is_line_of_numbers(line)) {
    const bool wrong = aligned_ && count_ != 0 && count_ != lines_;
    aligned_ = true;
    count_ = before_ = 0;
    return wrong ? Result::kDamaged : Result::kNone;
  }
  if (!aligned_) {
    return ++before_ == kPatienceFrames * lines_ ? Result::kNeverSeparated : Result::kNone;
  }
  if (count_ == 0) row_.clear();
  if (count_ == lines_ || row_.size() + line.size() > kMaxRow) {
    reset();
    return Result::kDamaged;
  }
  const char separator = separator_in(line);
  if (count_ > 0) row_ += separator;
  row_ += line.substr(0, line.find_last_not_of(" \t,;") + 1);
  return ++count_ == lines_ ? Result::kFrame : Result::kNone;
}

}  // namespace merkel
