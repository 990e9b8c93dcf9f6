#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include <fmt/format.h>
#include <unistd.h>

#include "core/parameters/parameter_error.hpp"
#include "drivers/files/column_text.hpp"
#include "drivers/printable_text.hpp"
#include "drivers/sessions/session_reader.hpp"
#include "drivers/sessions/session_records.hpp"
#include "tools/commands/command.hpp"

namespace merkel {
namespace {

struct InspectSessionOptions {
  std::string session;
  std::string stream;
  std::string fact;
};

/// The stream's name on the command line: its name in the file without "merkel.".
std::string_view short_name(const SessionStream& stream) {
  return stream.name.substr(stream.name.find('.') + 1);
}

std::string seconds(std::chrono::nanoseconds time) {
  std::string text;
  append_seconds(text, time);
  return text;
}

/// The column names of all counters, losses and rights.
std::string status_header() {
  std::string header;
  const auto add = [&](const auto& fields) {
    for (const auto& field : fields) header.append(header.empty() ? "" : ",").append(field.name);
  };
  add(kRunCounterFields<>);
  add(kLossFields);
  add(kRightFields);
  return header;
}

template <class Record>
std::string header_of() {
  std::string header = csv_header(SessionStreamOf<Record>::kColumns);
  if constexpr (std::is_same_v<Record, RunStatus>) header = status_header();
  if constexpr (std::is_same_v<Record, PortFrame>) header += ",bytes";
  return header;
}

template <class Record>
std::string row_of(const Record& record) {
  std::string row;
  append_csv(row, SessionStreamOf<Record>::kColumns, record);
  if constexpr (std::is_same_v<Record, PortFrame>) {
    row += fmt::format(",{:02x}", fmt::join(record.frame.content(), ""));
  }
  return row;
}

std::string row_of(const RunStatus& status) {
  std::string row;
  const auto add = [&](const auto& fields, const auto& values) {
    for (const auto& field : fields) {
      row.append(row.empty() ? "" : ",").append(std::to_string(values.*field.cell));
    }
  };
  add(kRunCounterFields<>, status.counters);
  add(kLossFields, status.losses);
  add(kRightFields, status.rights);
  return row;
}

std::string row_of(const Mark& mark) {
  std::string row = seconds(mark.time) + ",";
  append_field(row, printable_lines(mark.label));
  return row;
}

/// Calls work(chunk) for each chunk of a session. \return the exit code
template <class Work>
int for_each_chunk(SessionReader& session, const Work& work) {
  const auto read = session.for_each(work);
  return read ? kDone : refuse(read.error());
}

int print_marks(SessionReader& session) {
  std::puts("time_s,label");
  return for_each_chunk(session, [](const SessionChunk& chunk) {
    for (const Mark& mark : chunk.marks) std::puts(row_of(mark).c_str());
  });
}

/// The delay of the loop, one row for each change.
int print_delay(SessionReader& session) {
  std::puts("time_s,delay_s");
  std::optional<std::chrono::nanoseconds> last;
  return for_each_chunk(session, [&](const SessionChunk& chunk) {
    for (const TickRecord& tick : chunk.ticks) {
      if (last == tick.delay) continue;
      last = tick.delay;
      std::puts((seconds(tick.time) + "," + seconds(tick.delay)).c_str());
    }
  });
}

int print_stream(SessionReader& session, const SessionStream& stream) {
  std::string header;
  for_each_kind(RecordLists<RecordKind>{}, [&]<class Record>(const RecordKind<Record>&) {
    if constexpr (kStored<Record>) {
      if (SessionStreamOf<Record>::kId == stream.id) header = header_of<Record>();
    }
  });
  const std::size_t extra =
      stream.id == SessionStream::Id::kSamples ? session.extra_columns().size() : 0;
  for (std::size_t k = 0; k < extra; ++k) {
    append_field(header += ",", printable_column(session.extra_columns()[k]));
  }
  std::puts(header.c_str());
  return for_each_chunk(session, [&](const SessionChunk& chunk) {
    if (chunk.stream != stream.id) return;
    for_each_kind(chunk, [&]<class Record>(const std::vector<Record>& records) {
      if constexpr (kStored<Record>) {
        for (const Record& record : records) {
          std::string row = row_of(record);
          if constexpr (std::is_same_v<Record, DeliveredSample>) {
            for (std::size_t k = 0; k < extra; ++k) {
              row += "," + shortest_decimal(record.further[k]);
            }
          }
          std::puts(row.c_str());
        }
      }
    });
  });
}

/// A text of the file: at a terminal without control sequences, else as it is.
std::string shown(const std::string& text) {
  return ::isatty(STDOUT_FILENO) == 1 ? printable_lines(text) : text;
}

int print_fact(const SessionReader& session, const std::string& name) {
  const std::vector<std::string> values = session.facts(name);
  if (values.empty()) return refuse("the session notes no \"" + name + "\"");
  for (const std::string& value : values) std::puts(shown(value).c_str());
  return kDone;
}

/// Prints the facts of the session and the number of items of each stream.
int print_overview(SessionReader& session) {
  std::puts("name,value");
  for (const auto& [name, value] : session.facts()) {
    const auto lines = std::count(value.begin(), value.end(), '\n');
    std::string row = shown(name) + ",";
    append_field(row, lines == 0 ? shown(value) : std::to_string(lines) + " lines: --fact " + name);
    std::puts(row.c_str());
  }
  std::vector<std::uint64_t> items(session_streams().size());
  std::uint64_t marks = 0;
  const int read = for_each_chunk(session, [&](const SessionChunk& chunk) {
    marks += chunk.marks.size();
    if (!chunk.marks.empty()) return;
    items.at(static_cast<std::size_t>(chunk.stream) - 1) += count_of(chunk);
  });
  if (read != kDone) return read;
  for (const SessionStream& stream : session_streams()) {
    const bool rare =
        stream.id == SessionStream::Id::kTaxels || stream.id == SessionStream::Id::kTaxelZeros ||
        stream.id == SessionStream::Id::kSent || stream.id == SessionStream::Id::kSync ||
        stream.id == SessionStream::Id::kDrives;
    if (rare && items[static_cast<std::size_t>(stream.id) - 1] == 0) continue;
    std::puts(fmt::format("stream {},{}", short_name(stream),
                          items[static_cast<std::size_t>(stream.id) - 1])
                  .c_str());
  }
  std::puts(fmt::format("stream marks,{}", marks).c_str());
  std::printf("ended,%s\n", session.complete() ? "yes" : "no (the file is incomplete)");
  return kDone;
}

int inspect_session(const InspectSessionOptions& options) {
  auto session = SessionReader::open(options.session);
  if (!session) return refuse(session.error());
  if (!options.fact.empty()) return print_fact(*session, options.fact);
  if (options.stream.empty()) return print_overview(*session);
  if (options.stream == "marks") return print_marks(*session);
  if (options.stream == "delay") return print_delay(*session);
  std::string known;
  for (const SessionStream& stream : session_streams()) {
    if (options.stream == short_name(stream) || options.stream == stream.name) {
      return print_stream(*session, stream);
    }
    known.append(short_name(stream)).append(", ");
  }
  return refuse("--stream " + options.stream + " is not one of " + known + "delay, marks");
}

}  // namespace

void add_inspect_session_command(CommandLine& inspect) {
  auto options = std::make_shared<InspectSessionOptions>();
  inspect
      .subcommand(
          "session",
          "The contents of a recorded session: the facts of the run and the number of items in "
          "each stream, or the rows of one stream.",
          "inspect session session.xdf --stream frames")
      .option("session", options->session, kSessionHelp)
      .required()
      .option(
          "--stream", options->stream,
          "Print the rows of one stream: spikes, ticks, samples, events, status, frames (the "
          "devices' bytes, in hexadecimal), stimulation (commands of the encoder), sent (what left, "
          "and when), taxels (pressures of tactile arrays that changed), taxel_zeros (their zeros that changed), drives (of encoders of the user's own), sync (edges of sync lines), "
          "delay (of the loop, at each change), marks")
      .option("--fact", options->fact,
              "Print the fact of this name, for example scene_text or probe_calibration")
      .runs([options] { return inspect_session(*options); });
}

}  // namespace merkel
