#pragma once

#include <string>
#include <vector>

#include "core/expected.hpp"
#include "tools/connect/csv_readings.hpp"

namespace merkel {

/// The device found at a port.
struct Recognition {
  std::string address;            ///< URI without options
  int baud = 0;                   ///< 0: not a serial line
  std::string received;           ///< one line, or the bytes of a frame
  std::vector<Reading> readings;  ///< likeliest first; a single one is certain
};

/// Listens at an address (serial:PORT, udp:HOST:PORT, tcp:HOST:PORT) at one baud rate after the
/// other. If the device sends nothing, sends the requests of each protocol; none of them moves
/// anything. Takes up to 20 s. \return an error that quotes the received bytes if no protocol
/// matches
[[nodiscard]] Expected<Recognition, SetupError> recognise(const std::string& address);

}  // namespace merkel
