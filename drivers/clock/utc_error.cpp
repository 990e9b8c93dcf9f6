#include "drivers/clock/utc_error.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <system_error>
#include <vector>

#include <sys/timex.h>

#include "drivers/files/csv_text.hpp"
#include "drivers/take_part.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

constexpr std::size_t kMaxAnswer = 16'384;  ///< bytes of a program's output that are read
constexpr double kLargestError_s = 1e6;
constexpr std::string_view kChronyOwnClock = "7F7F0101";  ///< the reference 127.127.1.1

/// Places in a line of `chronyc -c tracking`.
constexpr std::size_t kChronyFields = 14;
constexpr std::size_t kChronyOffset = 4;
constexpr std::size_t kChronyDelay = 10;
constexpr std::size_t kChronyDispersion = 11;
constexpr std::size_t kChronyLeap = 13;

std::optional<UtcError> error_of(const char* source, double error_s) {
  if (!(error_s >= 0.0 && error_s <= kLargestError_s)) return std::nullopt;
  return UtcError{.source = source, .largest = nanoseconds{std::llround(error_s * 1e9)}};
}

/// The word that follows `name` in a line of its own.
std::string_view ptp_value(std::string_view answer, std::string_view name) {
  constexpr std::string_view kBlanks = " \t";
  while (!answer.empty()) {
    std::string_view line = take_part(answer, '\n');
    line.remove_prefix(std::min(line.find_first_not_of(kBlanks), line.size()));
    if (!line.starts_with(name)) continue;
    line.remove_prefix(name.size());
    const std::size_t begin = line.find_first_not_of(kBlanks);
    if (begin == 0 || begin == std::string_view::npos) continue;
    line.remove_prefix(begin);
    return line.substr(0, line.find_first_of(" \t\r"));
  }
  return {};
}

std::string output_of(const char* command) {
  struct ClosePipe {
    void operator()(FILE* file) const { ::pclose(file); }
  };
  std::string text;
  const std::unique_ptr<FILE, ClosePipe> pipe(::popen(command, "re"));
  std::array<char, 4096> part{};
  while (pipe && text.size() < kMaxAnswer) {
    const std::size_t count = std::fread(part.data(), 1, part.size(), pipe.get());
    if (count == 0) break;
    text.append(part.data(), count);
  }
  return text;
}

bool runs(const char* socket) {
  std::error_code ignored;
  return std::filesystem::exists(socket, ignored);
}

}  // namespace

std::optional<UtcError> chrony_error(std::string_view tracking) {
  std::string_view line = tracking.substr(0, tracking.find_first_of("\r\n"));
  std::vector<std::string_view> fields;
  while (!line.empty() && fields.size() <= kChronyFields) fields.push_back(take_field(line));
  if (fields.size() != kChronyFields || fields[0] == kChronyOwnClock ||
      fields[kChronyLeap] == "Not synchronised") {
    return std::nullopt;
  }
  const auto offset_s = parse_number(fields[kChronyOffset]);
  const auto delay_s = parse_number(fields[kChronyDelay]);
  const auto dispersion_s = parse_number(fields[kChronyDispersion]);
  if (!offset_s || !delay_s || !dispersion_s) return std::nullopt;
  return error_of("chrony", std::fabs(*offset_s) + *delay_s / 2 + *dispersion_s);
}

std::optional<UtcError> ptp_error(std::string_view answer) {
  const auto offset_ns = parse_number(ptp_value(answer, "offsetFromMaster"));
  const auto delay_ns = parse_number(ptp_value(answer, "meanPathDelay"));
  if (!offset_ns || !delay_ns || ptp_value(answer, "gmPresent") != "true") return std::nullopt;
  return error_of("ptp", (std::fabs(*offset_ns) + std::fabs(*delay_ns)) * 1e-9);
}

std::optional<UtcError> utc_error() {
  if (runs("/run/chrony") || runs("/var/run/chrony")) {
    if (auto error = chrony_error(output_of("timeout 1 chronyc -c -n tracking 2>/dev/null"))) {
      return error;
    }
  }
  if (runs("/run/ptp4l") || runs("/var/run/ptp4l")) {
    if (auto error = ptp_error(output_of("timeout 1 pmc -u -b 0 'GET CURRENT_DATA_SET' "
                                         "'GET TIME_STATUS_NP' 2>/dev/null"))) {
      return error;
    }
  }
  timex clock{};
  if (::adjtimex(&clock) == -1 || (clock.status & STA_UNSYNC) != 0) return std::nullopt;
  return UtcError{.source = "kernel", .largest = nanoseconds{std::int64_t{clock.maxerror} * 1000}};
}

}  // namespace merkel
