#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>

namespace merkel {

/// How far this machine's UTC may be from true UTC, and what says so: "chrony", "ptp" or "kernel".
struct UtcError {
  std::string source;
  std::chrono::nanoseconds largest{0};
};

/// From `chronyc -c tracking`: the bound that chrony's manual states, |system time| + root delay /
/// 2
/// + root dispersion. Empty if chrony follows no source, or the text is something else.
[[nodiscard]] std::optional<UtcError> chrony_error(std::string_view tracking);

/// From `pmc 'GET CURRENT_DATA_SET' 'GET TIME_STATUS_NP'`: |offset| + mean path delay, because an
/// asymmetry of the path is at most its delay. Empty without a grandmaster.
[[nodiscard]] std::optional<UtcError> ptp_error(std::string_view answer);

/// The error that the host's daemon reports: chrony, or else ptp4l; or else the kernel's largest
/// error, which ntpd and systemd-timesyncd maintain. Empty if the clock is not synchronised. Starts
/// chronyc or pmc if the daemon runs, and waits at most a second for each. Real-time: no.
[[nodiscard]] std::optional<UtcError> utc_error();

}  // namespace merkel
