#pragma once

#include <string>
#include <vector>

namespace merkel {

/// One interpretation of what a device sends.
struct Reading {
  std::string protocol = "csv";
  std::string columns;  ///< of lines of numbers: "time_ms,force_N"
  std::string style;    ///< further options of the probe URI, each after '&'
  std::string meaning;  ///< of one line or frame, human-readable: "force 0.3 N"

  /// Options of the probe URI.
  [[nodiscard]] std::string options() const {
    return "protocol=" + protocol + (columns.empty() ? "" : "&columns=" + columns) + style;
  }
};

/// The interpretations of lines of numbers, likeliest first. A header, labels and units decide;
/// only what they leave open is guessed. \param seconds  how long they took to arrive
[[nodiscard]] std::vector<Reading> readings_of_lines(const std::vector<std::string>& lines,
                                                     double seconds);

}  // namespace merkel
