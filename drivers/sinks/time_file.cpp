#include "drivers/sinks/time_file.hpp"

#include <string>
#include <utility>

#include <unistd.h>

#include "drivers/files/file_rename.hpp"

namespace merkel {
Expected<TimeFile, SetupError> TimeFile::beside(const OutputFile& file, const SinkSetup& setup) {
  if (file.part().empty()) return TimeFile(std::nullopt, false);  // a device or a pipe
  const std::string name = name_beside(file.path());
  if (!file.recovered().empty()) {
    static_cast<void>(rename_without_replacing(name, name_beside(file.recovered())));
  }
  // A failed run may have completed this file, but not the one it belongs to.
  if (::access(file.path().c_str(), F_OK) != 0) set_aside(name);
  auto made = OutputFile::create(name, setup.overwrite, setup.notice);
  if (!made) return Unexpected<SetupError>(made.error());
  return TimeFile(std::move(*made), setup.overwrite);
}

bool TimeFile::write(const TimeBase& time) {
  if (!file_) return true;
  if (time.plain()) {
    const std::string path = file_->path();
    file_->remove();
    if (overwrite_) ::unlink(path.c_str());  // of the run whose files are replaced
    return true;
  }
  std::string text;
  for (const auto& [name, value] : time.facts()) text += name + " = " + value + "\n";
  return file_->write(text) && file_->close();
}

}  // namespace merkel
