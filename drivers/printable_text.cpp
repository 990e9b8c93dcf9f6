#include "drivers/printable_text.hpp"

#include <algorithm>
#include <cstdint>

#include "core/printed.hpp"

namespace merkel {
namespace {

constexpr std::size_t kMaxWord = 300;
constexpr std::size_t kMaxMessage = 4000;

/// The first two thirds and the last sixth of `longest` bytes.
std::string without_middle(std::string_view text, std::size_t longest) {
  if (text.size() <= longest) return std::string(text);
  const std::size_t end = longest / 6;
  return std::string(text.substr(0, 4 * end)) + "[...]" +
         std::string(text.substr(text.size() - end));
}

/// The length of the well-formed UTF-8 character at the start of a text, and its code point; 0 if
/// the text does not start with one.
std::size_t first_character(std::string_view text, std::uint32_t& code) noexcept {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(text[i]); };
  const std::uint8_t lead = byte(0);
  const std::size_t length = lead < 0x80                   ? 1
                             : lead >= 0xC2 && lead < 0xE0 ? 2
                             : lead >= 0xE0 && lead < 0xF0 ? 3
                             : lead >= 0xF0 && lead < 0xF5 ? 4
                                                           : 0;
  if (length == 0 || length > text.size()) return 0;
  code = length == 1 ? lead : lead & (0xFFU >> (length + 1));
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0U) != 0x80U) return 0;
    code = code << 6U | (byte(i) & 0x3FU);
  }
  constexpr std::uint32_t kMin[] = {0, 0, 0x80, 0x800, 0x10000};
  return code >= kMin[length] && code < 0x110000 ? length : 0;
}

bool harmless(std::uint32_t code) noexcept {
  if (code < 0x20 || (code >= 0x7F && code < 0xA0)) return false;
  if (code >= 0x200B && code <= 0x200F) return false;  // zero width or direction marks
  if (code >= 0x2028 && code <= 0x202E) return false;  // line separators and direction marks
  if (code >= 0x2060 && code <= 0x206F) return false;
  if (code >= 0xD800 && code <= 0xF8FF) return false;  // surrogates, private use
  return code != 0xFEFF && code < 0xE0000;
}

}  // namespace

std::string printable_text(std::string_view text, std::size_t longest) {
  std::string printable;
  while (!text.empty()) {
    std::uint32_t code = 0;
    const std::size_t length = first_character(text, code);
    const bool good = length > 0 && harmless(code);
    if (printable.size() + (good ? length : 1) > longest) {
      printable += "...";
      break;
    }
    if (good) {
      printable += text.substr(0, length);
    } else {
      printable += '?';
    }
    text.remove_prefix(length > 0 ? length : 1);
  }
  return printable;
}

std::string utf8_text(std::string_view text) {
  std::string valid;
  while (!text.empty()) {
    std::uint32_t code = 0;
    const std::size_t length = first_character(text, code);
    const bool character = (code < 0xD800 || code > 0xDFFF) && code != 0xFFFE && code != 0xFFFF;
    valid += length > 0 && character ? text.substr(0, length) : "\xEF\xBF\xBD";
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return valid;
}

std::string printable_column(std::string_view name) {
  std::string text = printable_text(name);
  std::replace(text.begin(), text.end(), ',', '_');
  return text;
}

bool is_text(std::string_view bytes) noexcept {
  const auto readable = std::count_if(bytes.begin(), bytes.end(), [](char byte) {
    return (byte >= 0x20 && byte < 0x7F) || byte == '\n' || byte == '\r' || byte == '\t';
  });
  return 20 * static_cast<std::size_t>(readable) >= 19 * bytes.size();
}

std::string quoted_answer(std::string_view bytes) {
  constexpr std::string_view kLineEnds = "\r\n";
  constexpr std::size_t kQuotedCharacters = 60;
  constexpr std::size_t kQuotedBytes = 32;
  const std::string_view line =
      bytes.substr(std::min(bytes.find_first_not_of(kLineEnds), bytes.size()));
  if (!line.empty() && is_text(bytes)) {
    return "\"" + printable_text(line.substr(0, line.find_first_of(kLineEnds)), kQuotedCharacters) +
           "\"";
  }
  std::string text;
  for (const char byte : bytes.substr(0, kQuotedBytes)) {
    text += printed(" %02X", static_cast<std::uint8_t>(byte));
  }
  if (text.empty()) return text;
  return "the " + std::to_string(bytes.size()) + " bytes" + text +
         (bytes.size() > kQuotedBytes ? " ..." : "");
}

std::string shortened(std::string_view message) {
  std::string text;
  while (!message.empty()) {
    const auto end = std::min(message.find_first_of(" \n\t"), message.size());
    text += without_middle(message.substr(0, end), kMaxWord);
    const auto next = std::min(message.find_first_not_of(" \n\t", end), message.size());
    text += message.substr(end, next - end);
    message.remove_prefix(next);
  }
  return without_middle(text, kMaxMessage);
}

std::string printable_lines(std::string_view text) {
  std::string printable;
  while (true) {
    const auto end = std::min(text.find_first_of("\n\t"), text.size());
    printable += printable_text(text.substr(0, end), text.size() + 1);
    if (end == text.size()) return printable;
    printable += text[end];
    text.remove_prefix(end + 1);
  }
}

}  // namespace merkel
