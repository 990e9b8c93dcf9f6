#include "tools/run/terminal_line.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <fmt/core.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "drivers/printable_text.hpp"

namespace merkel {
namespace {

constexpr std::size_t kUsualColumns = 80;
constexpr std::size_t kBar = 8;

/// Columns of the terminal minus one, so that the cursor stays on the line.
std::size_t columns_now() {
  winsize size{};
  const bool known = ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1;
  return (known ? size.ws_col : kUsualColumns) - 1;
}

/// Width of a text in columns; UTF-8 continuation bytes have none.
std::size_t width_of(std::string_view text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U;
  }));
}

std::string cut(std::string_view text, std::size_t columns) {
  std::size_t width = 0;
  std::size_t end = 0;
  for (; end < text.size(); ++end) {
    const bool begins = (static_cast<unsigned char>(text[end]) & 0xC0U) != 0x80U;
    if (begins && ++width > columns) break;
  }
  return std::string(text.substr(0, end));
}

}  // namespace

std::string fit_line(const std::vector<std::string>& fields, std::size_t columns) {
  std::string line;
  for (const std::string& field : fields) {
    if (field.empty()) continue;
    if (line.empty()) {
      line = cut(field, columns);
      continue;
    }
    if (width_of(line) + 2 + width_of(field) > columns) break;
    line += "  " + field;
  }
  return line;
}

TerminalLine::TerminalLine() : on_terminal_(::isatty(STDERR_FILENO) == 1) {}

void TerminalLine::show(const std::vector<std::string>& fields) {
  if (!on_terminal_) return;
  shown_ = fit_line(fields, columns_now());
  std::fprintf(stderr, "\r\033[K%s", shown_.c_str());
  std::fflush(stderr);
}

void TerminalLine::print_line(const std::string& sentence) {
  const bool line = on_terminal_ && !shown_.empty();
  std::fprintf(stderr, "%s%s\n", line ? "\r\033[K" : "", shortened(sentence).c_str());
  if (line) std::fputs(cut(shown_, columns_now()).c_str(), stderr);
  std::fflush(stderr);
}

void TerminalLine::print_notices(const std::vector<std::string>& notices) {
  for (const std::string& sentence : notices) print_line("merkel: " + sentence);
}

void TerminalLine::clear() {
  if (shown_.empty()) return;
  std::fputs("\r\033[K", stderr);
  std::fflush(stderr);
  shown_.clear();
}

std::string ReadingBar::text(const LiveReading& reading) {
  std::string line;
  if (reading.force_N) line += fmt::format("{:.3f} N ", *reading.force_N);
  if (reading.depth_mm) line += fmt::format("{:.2f} mm ", *reading.depth_mm);
  if (line.empty()) return line;
  const double value = std::max(reading.force_N.value_or(reading.depth_mm.value_or(0.0)), 0.0);
  largest_ = std::max(largest_, value);
  const double share = largest_ > 0.0 ? value / largest_ : 0.0;
  const auto filled = static_cast<std::size_t>(std::lround(share * static_cast<double>(kBar)));
  return line + "[" + std::string(filled, '#') + std::string(kBar - filled, ' ') + "]";
}

}  // namespace merkel
