#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "core/expected.hpp"

namespace merkel {

/// One interpretation of what a device sends.
struct Reading {
  std::string options;  ///< options of the probe URI, starting with "protocol="
  std::string meaning;  ///< of one line or frame, human-readable: "force 0.3 N"
};

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

/// Every interpretation of lines of numbers. \param seconds  how long they took to arrive
[[nodiscard]] std::vector<Reading> readings_of_lines(const std::vector<std::string>& lines,
                                                     double seconds);

}  // namespace merkel
