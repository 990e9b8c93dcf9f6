#include "drivers/files/toml_guard.hpp"

#include <algorithm>
#include <cstddef>
#include <optional>

#include "drivers/files/csv_text.hpp"

namespace merkel {
namespace {

constexpr std::size_t kMaxKeyParts = 16;
constexpr std::string_view kWhiteSpace = " \t\n\v\f\r";

bool is_ascii(char c) { return static_cast<unsigned char>(c) < 0x80U; }

class Guard {
 public:
  explicit Guard(std::string_view text) : text_(text) { guarded_.reserve(text.size() + 64); }

  Expected<std::string, TomlError> run() {
    at_ = text_.size() - without_byte_order_mark(text_).size();
    while (!done() && reason_.empty()) {
      const char c = here();
      if (c == '#') {
        consume_until(std::min(text_.find('\n', at_), text_.size()));
      } else if (c == '"' || c == '\'') {
        guarded_ += ' ';
        take_quoted(c);
      } else {
        take_plain(c);
      }
    }
    if (reason_.empty()) return std::move(guarded_);
    const auto newlines = std::count(text_.begin(), text_.begin() + at_offset(), '\n');
    return Unexpected<TomlError>(
        {.line = static_cast<std::uint32_t>(newlines) + 1, .reason = std::move(reason_)});
  }

 private:
  [[nodiscard]] bool done() const { return at_ >= text_.size(); }
  [[nodiscard]] char here() const { return text_[at_]; }
  [[nodiscard]] std::ptrdiff_t at_offset() const { return static_cast<std::ptrdiff_t>(at_); }
  void take() { guarded_ += text_[at_++]; }
  void consume_until(std::size_t end) {
    guarded_.append(text_.substr(at_, end - at_));
    at_ = end;
  }

  void take_plain(char c) {
    if (!is_ascii(c)) {
      reason_ = "this line has a non-ASCII character outside quotes";
      return;
    }
    // A number has at most one point; these characters end a key.
    if (std::string_view("\n,[{=").find(c) != std::string_view::npos) points_ = 0;
    if (c == '.' && ++points_ >= kMaxKeyParts) {
      reason_ = "a dotted key has more than 16 parts";
      return;
    }
    take();
  }

  void take_quoted(char quote) {
    const std::size_t opening = quotes(quote);
    const bool multi_line = opening >= 3;
    consume_until(at_ + (multi_line ? 3 : 1));
    if (opening == 2) return take();  // an empty string
    bool trimming = false;            // after a backslash at the end of a line
    while (!done() && reason_.empty()) {
      const char c = here();
      if (c == quote) {
        trimming = false;
        const std::size_t closing = std::min<std::size_t>(quotes(quote), 5);
        consume_until(at_ + (multi_line ? closing : 1));
        if (!multi_line || closing >= 3) return;
      } else if (c == '\n' && !multi_line) {
        return;  // an error, which the parser reports
      } else if (c == '\\' && quote == '"') {
        take();
        trimming = take_escaped();
      } else if (trimming && !is_ascii(c)) {
        reason_ = "the text after a trimmed line end must start with an ASCII character";
      } else {
        trimming = trimming && kWhiteSpace.find(c) != std::string_view::npos;
        take();
      }
    }
  }

  /// True if the escaped character is white space, which starts trimming.
  bool take_escaped() {
    if (done()) return false;
    if (!is_ascii(here())) {
      reason_ = "a backslash in quotes is followed by a non-ASCII character";
      return false;
    }
    const bool white = kWhiteSpace.find(here()) != std::string_view::npos;
    take();
    return white;
  }

  /// The number of consecutive quotes from here.
  [[nodiscard]] std::size_t quotes(char quote) const {
    return std::min(text_.find_first_not_of(quote, at_), text_.size()) - at_;
  }

  std::string_view text_;
  std::size_t at_ = 0;
  std::string guarded_;
  std::string reason_;
  std::size_t points_ = 0;
};

}  // namespace

Expected<std::string, TomlError> guard_toml(std::string_view text) { return Guard(text).run(); }

}  // namespace merkel
