#pragma once

#include <string>
#include <vector>

namespace merkel {

/// One interpretation of what a device sends.
struct Reading {
  std::string protocol = "csv";
  std::string columns = {};               ///< of lines of numbers: "time_ms,force_N"
  std::string style;                      ///< further options of the probe URI, each after '&'
  std::vector<std::string> assumed = {};  ///< columns whose units the lines do not state
  std::string meaning;                    ///< of one line or frame, human-readable: "force 0.3 N"

  /// Options of the probe URI.
  [[nodiscard]] std::string options() const {
    return "protocol=" + protocol + (columns.empty() ? "" : "&columns=" + columns) + style;
  }
};

/// The interpretations of lines of numbers, likeliest first. A header, labels and units decide;
/// only what they leave open is guessed. Lines of JSON, lines of labels and frames of several lines
/// are recognised. \param lines  empty ones included. \param seconds  how long they took to arrive
[[nodiscard]] std::vector<Reading> readings_of_lines(std::vector<std::string> lines,
                                                     double seconds);

}  // namespace merkel
