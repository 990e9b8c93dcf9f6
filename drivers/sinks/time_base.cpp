#include "drivers/sinks/time_base.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <string_view>

namespace merkel {
namespace {

constexpr std::array<std::string_view, 3> kWords = {"run", "unix", "device"};  // by TimeZero

}  // namespace

TimeBase TimeBase::read(UriOptions& options, const SinkSetup& setup) {
  const std::string word =
      options.word("time", kWords[static_cast<std::size_t>(setup.time_zero)], "run|unix|device");
  const auto* const found = std::find(kWords.begin(), kWords.end(), word);
  return TimeBase(found == kWords.end() ? setup.time_zero
                                        : static_cast<TimeZero>(found - kWords.begin()));
}

void TimeBase::set(const RunOrigin& origin) noexcept {
  origin_ = origin;
  if (zero_ == TimeZero::kRun) offset_ = origin.start;
  if (zero_ == TimeZero::kUnix) offset_ = origin.start - origin.utc;
}

std::vector<std::pair<std::string, std::string>> TimeBase::facts() const {
  std::vector<std::pair<std::string, std::string>> facts = {
      {"time_zero", std::string(kWords[static_cast<std::size_t>(zero_)])},
      {"time_offset_ns", std::to_string(offset_.count())},
      {"start_device_ns", std::to_string(origin_.start.count())}};
  if (origin_.utc.count() != 0) {
    facts.emplace_back("start_utc_ns", std::to_string(origin_.utc.count()));
  }
  return facts;
}

}  // namespace merkel
