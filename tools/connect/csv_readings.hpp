#pragma once

#include <string>
#include <vector>

namespace merkel {

/// One interpretation of what a device sends.
struct Reading {
  std::string options;  ///< options of the probe URI, starting with "protocol="
  std::string meaning;  ///< of one line or frame, human-readable: "force 0.3 N"
};

/// Every interpretation of lines of numbers. \param seconds  how long they took to arrive
[[nodiscard]] std::vector<Reading> readings_of_lines(const std::vector<std::string>& lines,
                                                     double seconds);

}  // namespace merkel
