#include "drivers/sinks/rows_sink.hpp"

#include <cstdio>
#include <utility>

#include <sys/stat.h>

#include "drivers/files/file_rename.hpp"

namespace merkel {

Expected<OutputFile, SetupError> RowsSink::open_rows(const Uri& uri, const SinkSetup& setup) {
  struct stat status {};
  if (uri.path == "-" || (::stat(uri.path.c_str(), &status) == 0 && !S_ISREG(status.st_mode) &&
                          !S_ISDIR(status.st_mode))) {
    return bad_input("\"" + uri.text + "\": HDF5 is written to regular files only");
  }
  return OutputFile::create(uri.path, setup.overwrite, setup.notice);
}

void RowsSink::convert_recovered(
    const std::string& recovered, const std::string& what, const SinkSetup& setup,
    const std::function<Expected<void, std::string>(const std::string& rows)>& convert) {
  const std::string rows = recovered + ".part";
  if (rename_without_replacing(recovered, rows) != 0) return;
  const auto written = convert(rows);
  if (written) {
    static_cast<void>(std::remove(rows.c_str()));
  } else if (setup.notice) {
    setup.notice(written.error() + "; " + what + " in " + rows + ", as text");
  }
}

RowsSink::RowsSink(std::string uri, OutputFile rows, TimeBase time, bool overwrite,
                   std::string_view what)
    : uri_(std::move(uri)),
      rows_(std::move(rows)),
      path_(rows_.path()),
      time_(time),
      overwrite_(overwrite),
      what_(what) {}

Expected<void, SinkError> RowsSink::begin(const RunOrigin& origin) {
  if (std::exchange(started_, true)) return {};
  time_.set(origin);
  std::string text;
  for (const auto& [name, value] : time_.facts()) text += "# " + name + "=" + value + "\n";
  const bool written = rows_.write(text + head(origin));
  rows_.end_header();
  return settle(written);
}

Expected<void, SinkError> RowsSink::write_rows(std::string_view text, std::size_t spikes) {
  if (auto started = begin({}); !started) return started;
  taken_ += spikes;
  return settle(rows_.write(text));
}

Expected<void, SinkError> RowsSink::close() {
  if (auto started = begin({}); !started) return started;
  if (auto flushed = flush(); !flushed) return flushed;
  if (auto written = convert(path_, overwrite_); !written) {
    return Unexpected<SinkError>({.sentence = written.error() + "; " + what_ + " in " +
                                              rows_.part() +
                                              ", as text: free some space, and run again"});
  }
  rows_.remove();
  return {};
}

Expected<void, SinkError> RowsSink::settle(bool succeeded) {
  if (!succeeded) return Unexpected<SinkError>({.sentence = rows_.error()});
  if (rows_.settled()) delivered_ = taken_;
  return {};
}

}  // namespace merkel
