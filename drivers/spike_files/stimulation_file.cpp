#include "drivers/spike_files/stimulation_file.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>
#include <system_error>

#include "drivers/files/csv_text.hpp"
#include "drivers/files/line_reader.hpp"
#include "drivers/parsed_number.hpp"
#include "drivers/sinks/stimulation_text.hpp"
#include "drivers/spike_files/recorded_zero.hpp"

namespace merkel {
namespace {

using Kind = StimulationCommand::Kind;
using Stop = StimulationCommand::Stop;

constexpr std::array kCommandKinds = {Kind::kUpdate, Kind::kPulse};
constexpr auto kStops = [] {
  std::array<Stop, static_cast<std::size_t>(Stop::kLast) + 1> all{};
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<Stop>(i);
  return all;
}();

template <class Words>
auto named(const Words& words, std::string_view name) {
  const auto found = std::find_if(words.begin(), words.end(),
                                  [&](const auto word) { return name_of(word) == name; });
  return found == words.end() ? std::nullopt : std::optional(*found);
}

/// Whole nanoseconds; 0 for a field that older files lack.
std::optional<std::chrono::nanoseconds> parse_ns(std::string_view text) {
  const auto count = text.empty() ? 0 : parsed_number<std::int64_t>(text);
  if (!count || *count < 0) return std::nullopt;
  return std::chrono::nanoseconds{*count};
}

bool is_command_header(std::string_view line) {
  return line == StimulationText::csv_header() || line == StimulationText::older_csv_header();
}

/// A row, as StimulationText::append_row() writes it. Empty if it is not one.
std::optional<RecordedCommand> command_of(std::string_view row) {
  const auto time = parse_seconds(take_field(row));
  const std::string_view electrode = take_field(row);
  const auto kind = named(kCommandKinds, take_field(row));
  const auto amplitude_uA = parse_number(take_field(row));
  const auto frequency_Hz = parse_number(take_field(row));
  const auto heartbeat = parse_number(take_field(row));
  const auto stop = named(kStops, take_field(row));
  const auto sent = parse_ns(take_field(row));
  const auto valid_until = parse_ns(take_field(row));
  if (!time || electrode.empty() || !kind || !amplitude_uA || !frequency_Hz || !heartbeat ||
      !stop || !sent || !valid_until || !row.empty()) {
    return std::nullopt;
  }
  return RecordedCommand{.time = *time,
                         .electrode = std::string(electrode),
                         .kind = *kind,
                         .amplitude_uA = *amplitude_uA,
                         .frequency_Hz = *frequency_Hz,
                         .stop = *stop,
                         .sent = *sent};
}

void sort_by_time(std::vector<RecordedCommand>& commands) {
  std::stable_sort(commands.begin(), commands.end(),
                   [](const auto& a, const auto& b) { return a.time < b.time; });
}

}  // namespace

bool is_stimulation_csv(const std::string& path) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) return false;  // a pipe is read once
  auto lines = LineReader::open(path);
  while (lines && lines->next() == LineReader::Outcome::kLine) {
    const std::string_view line = lines->line();
    if (!line.empty() && !line.starts_with('#')) return is_command_header(line);
  }
  return false;
}

Expected<StimulationFile, SetupError> read_stimulation_csv(const std::string& path) {
  StimulationFile file;
  RecordedZero zero;
  bool header_found = false;
  const std::string wrong_header =
      std::string("expected the header ") + StimulationText::csv_header();
  const std::string wrong_row =
      std::string("this is not a stimulation command: expected ") + StimulationText::csv_header();
  const auto read = read_rows(path, [&](std::string_view row) -> const char* {
    if (!header_found) {
      header_found = is_command_header(row);
      return header_found ? nullptr : wrong_header.c_str();
    }
    auto command = command_of(row);
    if (!command) return wrong_row.c_str();
    file.commands.push_back(std::move(*command));
    return nullptr;
  });
  if (!read) return Unexpected<SetupError>(read.error());
  zero.take_file_beside(path);
  file.from_start = zero.apply(file.commands);
  sort_by_time(file.commands);
  return file;
}

Expected<StimulationFile, SetupError> read_session_commands(
    SessionReader& session, std::span<const std::string> electrodes) {
  const auto origin = session_origin(session);
  if (!origin) return Unexpected<SetupError>(origin.error());
  StimulationFile file{.commands = {}, .from_start = true};
  const auto add = [&](const StimulationCommand& command, std::chrono::nanoseconds sent,
                       std::vector<RecordedCommand>& list) {
    if (command.electrode >= electrodes.size()) return false;
    list.push_back({.time = command.time - origin->start,
                    .electrode = electrodes[command.electrode],
                    .kind = command.kind,
                    .amplitude_uA = command.amplitude_uA,
                    .frequency_Hz = command.frequency_Hz,
                    .stop = command.stop,
                    .sent = sent});
    return true;
  };
  const auto unknown = [&](const StimulationCommand& command) {
    return bad_input(session.path() + " has a command for electrode " +
                     std::to_string(command.electrode + 1) +
                     ", which its scene does not have: the session is damaged");
  };
  SessionChunk chunk;
  for (;;) {
    const auto more = session.next(chunk);
    if (!more) return Unexpected<SetupError>(more.error());
    if (!*more) break;
    for (const StimulationCommand& command : chunk.commands) {
      if (!add(command, {}, file.commands)) return unknown(command);
    }
    for (const SentCommand& item : chunk.sent) {
      if (item.refused_by != 0) continue;
      if (!add(item.command, item.sent, file.sent)) return unknown(item.command);
    }
  }
  sort_by_time(file.sent);
  sort_by_time(file.commands);
  return file;
}

}  // namespace merkel
