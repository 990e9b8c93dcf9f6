#pragma once

#include <string>
#include <vector>

#include "core/expected.hpp"
#include "tools/connect/csv_readings.hpp"

namespace merkel {

/// The device found at a port.
struct Recognition {
  std::string address;                 ///< URI without options
  int baud = 0;                        ///< 0: not a serial line
  std::string received = {};           ///< quoted_answer()
  std::vector<Reading> readings = {};  ///< likeliest first; a single one is certain

  /// The whole probe URI with one of the readings.
  [[nodiscard]] std::string uri(const Reading& reading) const {
    return address + "?" + reading.options() + (baud != 0 ? "&baud=" + std::to_string(baud) : "");
  }
};

/// Listens at an address (serial:PORT, udp:HOST:PORT, tcp:HOST:PORT) at one baud rate after the
/// other, each time for as long as a board takes that resets when its port is opened. If the device
/// sends nothing readable, sends the requests of each protocol; none of them moves anything. Takes
/// up to a minute. \return an error that quotes the received bytes if no protocol
/// matches
/// \param allow_remote  as in open_probe()
[[nodiscard]] Expected<Recognition, SetupError> recognise(const std::string& address,
                                                          bool allow_remote);

}  // namespace merkel
