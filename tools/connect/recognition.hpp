#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "core/expected.hpp"

namespace merkel {

/// One way to read what a device sends.
struct Reading {
  std::string options;  ///< of the probe URI, beginning with "protocol="
  std::string meaning;  ///< of one line or frame, for people: "force 0.3 N"
};

/// What was found at a port.
struct Recognition {
  std::string address;            ///< URI without options
  int baud = 0;                   ///< 0: the line has none
  std::string received;           ///< one line, or the bytes of a frame
  std::vector<Reading> readings;  ///< likeliest first; the first is certain where it is alone
};

/// Listens at an address (serial:PORT, udp:HOST:PORT, tcp:HOST:PORT) at one baud rate after the
/// other; a device that says nothing is asked in the language of each protocol, with questions that
/// move nothing. Fails with what was received where nothing can be made of it. Takes up to 20 s.
[[nodiscard]] Expected<Recognition, SetupError> recognise(const std::string& address);

/// Every way to read lines of numbers. \param seconds  how long they took to arrive
[[nodiscard]] std::vector<Reading> readings_of_lines(const std::vector<std::string>& lines,
                                                     double seconds);

}  // namespace merkel
