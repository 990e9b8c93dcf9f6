// A data-acquisition card that replaces comedilib's calls, and read() and ppoll() of its node, at
// link time. It lives in virtual time, and can fail in ways that no driver does on demand.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "drivers/probes/host_clock.hpp"

namespace merkel {

class VirtualHostClock final : public HostClock {
 public:
  [[nodiscard]] std::chrono::nanoseconds now() override { return time; }
  void sleep_for(std::chrono::nanoseconds duration) override { time += duration; }
  std::chrono::nanoseconds time{std::chrono::seconds{1000}};
};

struct FakeComediCard {
  struct Range {
    double low = -10.0;
    double high = 10.0;
    unsigned unit = 0;  ///< V; 1: mA
  };
  VirtualHostClock clock;

  // What it is.
  int open_error = 0;  ///< errno
  bool scans = true;   ///< by a clock of its own
  bool long_samples = false;
  bool differential = false;
  bool soft_calibrated = false;
  std::string calibration_file;  ///< its path; empty: none
  unsigned channels = 8;
  unsigned largest = 65535;
  std::vector<Range> ranges = {{-10.0, 10.0, 0}, {-5.0, 5.0, 0}, {0.0, 10.0, 0}};
  std::int64_t shortest_period_ns = 1000;
  std::int64_t period_step_ns = 50;
  double drift = 0.0;  ///< of its clock; positive: fast
  int largest_buffer = 1 << 20;
  int buffer = 1 << 16;                   ///< bytes
  std::chrono::nanoseconds read_time{0};  ///< that a read() takes
  int refused_at = 0;                     ///< step of comedi_command_test
  int command_error = 0;

  // What happens to it.
  bool unplugged = false;
  bool ends_at_once = false;  ///< every command

  // What it did.
  int opened = 0;
  int commands = 0;
  std::int64_t period_ns = 0;
  std::vector<unsigned> list;  ///< of the command: channel, range and reference packed
  std::uint64_t scanned = 0;   ///< scans of all commands, those lost included

  /// The raw value of a channel in a scan, counted over all commands: neither end of its range.
  [[nodiscard]] std::uint32_t value(std::uint64_t scan, unsigned channel) const {
    return 1 + static_cast<std::uint32_t>((scan + 100ULL * channel) % (largest - 1));
  }
};

/// The card that comedi_open() opens; null: none. Reset by each test.
extern FakeComediCard* fake_comedi_card;

}  // namespace merkel
