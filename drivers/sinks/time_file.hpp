#pragma once

#include <optional>
#include <string>

#include "core/expected.hpp"
#include "drivers/files/output_file.hpp"
#include "drivers/sink_setup.hpp"
#include "drivers/sinks/time_base.hpp"

namespace merkel {

/// The file NAME.time beside a text file: how the times in NAME convert to probe times, as lines
/// NAME = VALUE (TimeBase::facts). It is apart, so that NAME itself has the same form after every
/// run. Written only if the times are not the probe's, and only beside a regular file.
class TimeFile {
 public:
  /// Fails if NAME.time exists, unless `overwrite`. The one of a killed run keeps its name beside
  /// the recovered file.
  [[nodiscard]] static Expected<TimeFile, SetupError> beside(const OutputFile& file,
                                                             const SinkSetup& setup);

  /// Completes the file, or removes it if it is not needed. False after an error.
  [[nodiscard]] bool write(const TimeBase& time);
  [[nodiscard]] const std::string& error() const { return file_->error(); }

  [[nodiscard]] static std::string name_beside(const std::string& path) { return path + ".time"; }

 private:
  explicit TimeFile(std::optional<OutputFile> file, bool overwrite)
      : file_(std::move(file)), overwrite_(overwrite) {}

  std::optional<OutputFile> file_;
  bool overwrite_;
};

}  // namespace merkel
