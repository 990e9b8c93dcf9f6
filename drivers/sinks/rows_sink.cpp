#include "drivers/sinks/rows_sink.hpp"

#include <charconv>
#include <cstdint>
#include <cstdio>
#include <utility>

#include <sys/stat.h>

#include "drivers/files/file_rename.hpp"
#include "drivers/files/line_reader.hpp"

namespace merkel {
namespace {

constexpr std::size_t kPiece = 1000;  ///< bytes of JSON in a line

/// Reads the lines before the rows. Throws an exception of the JSON library if they do not describe
/// the run.
RowsSink::Recovered read_head(const std::string& rows) {
  RowsSink::Recovered run{.rows = rows, .content = {}};
  const auto take = [](std::string_view line, std::string_view name, auto& value) {
    if (!line.starts_with(name)) return;
    std::int64_t count = 0;
    line.remove_prefix(name.size());
    std::from_chars(line.data(), line.data() + line.size(), count);
    value = std::chrono::nanoseconds{count};
  };
  std::string text;
  auto lines = LineReader::open(rows);
  while (lines && lines->next() == LineReader::Outcome::kLine && lines->line().starts_with('#')) {
    const std::string_view line = lines->line();
    take(line, "# time_offset_ns=", run.offset);
    take(line, "# start_device_ns=", run.origin.start);
    take(line, "# start_utc_ns=", run.origin.utc);
    if (line.starts_with(RowsSink::kContentMark)) {
      text += line.substr(RowsSink::kContentMark.size());
    }
  }
  run.content = nlohmann::json::parse(text);
  return run;
}

}  // namespace

Expected<OutputFile, SetupError> RowsSink::open_rows(const Uri& uri, const SinkSetup& setup) {
  struct stat status {};
  if (uri.path == "-" || (::stat(uri.path.c_str(), &status) == 0 && !S_ISREG(status.st_mode) &&
                          !S_ISDIR(status.st_mode))) {
    return bad_input("\"" + uri.text + "\": HDF5 can only be written to a regular file");
  }
  return OutputFile::create(uri.path, setup.overwrite, setup.notice);
}

std::string RowsSink::content_lines(const nlohmann::json& content) {
  const std::string text = content.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
  std::string lines;
  for (std::size_t place = 0; place < text.size(); place += kPiece) {
    lines.append(kContentMark).append(text, place, kPiece).append("\n");
  }
  return lines;
}

void RowsSink::convert_recovered(
    const std::string& recovered, const std::string& what, const SinkSetup& setup,
    const std::function<Expected<void, std::string>(const Recovered& run)>& convert) {
  const std::string rows = recovered + ".part";
  if (rename_without_replacing(recovered, rows) != 0) return;
  Expected<void, std::string> written;
  try {
    written = convert(read_head(rows));
  } catch (const nlohmann::json::exception&) {
    written = Unexpected<std::string>("cannot convert " + rows +
                                      ": it does not describe its run, or is damaged");
  }
  if (written) {
    static_cast<void>(std::remove(rows.c_str()));
  } else if (setup.notice) {
    setup.notice(written.error() + "; " + what + " in " + rows + ", as text");
  }
}

RowsSink::RowsSink(std::string uri, OutputFile rows, TimeBase time, bool overwrite,
                   std::string_view what)
    : FileSink(std::move(uri), std::move(rows)),
      path_(file().path()),
      time_(time),
      overwrite_(overwrite),
      what_(what) {}

Expected<void, SinkError> RowsSink::start(const RunOrigin& origin) {
  time_.set(origin);
  std::string text;
  for (const auto& [name, value] : time_.facts()) text += "# " + name + "=" + value + "\n";
  const bool written = file().write(text + head(origin));
  file().end_header();
  return settle(written);
}

Expected<void, SinkError> RowsSink::write_rows(std::string_view text, std::size_t spikes) {
  if (auto started = begin({}); !started) return started;
  return settle(file().write(text), spikes);
}

Expected<void, SinkError> RowsSink::close() {
  if (auto started = begin({}); !started) return started;
  if (auto flushed = flush(); !flushed) return flushed;
  if (auto written = convert(path_, overwrite_); !written) {
    return Unexpected<SinkError>({.sentence = written.error() + "; " + what_ + " in " +
                                              file().part() +
                                              ", as text: free some space, and run again"});
  }
  file().remove();
  return {};
}

}  // namespace merkel
