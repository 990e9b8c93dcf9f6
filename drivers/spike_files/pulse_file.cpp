#include "drivers/spike_files/pulse_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>
#include <utility>

#include <nlohmann/json.hpp>

#include "drivers/files/csv_text.hpp"
#include "drivers/files/input_file.hpp"
#include "drivers/files/line_reader.hpp"
#include "drivers/files/npy_file.hpp"
#include "drivers/sessions/session_reader.hpp"
#include "drivers/sessions/session_samples.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;
using Path = std::filesystem::path;

constexpr double kLargestTime_s = 4e9;

std::optional<nanoseconds> time_of_s(double time_s) {
  if (!(std::fabs(time_s) <= kLargestTime_s)) return std::nullopt;
  return nanoseconds{std::llround(time_s * 1e9)};
}

/// The unit of a header's time in ns; empty for another text.
std::optional<std::int64_t> unit_of_header(std::string_view name) {
  for (const auto& [known, unit_ns] :
       {std::pair<std::string_view, std::int64_t>{"time_s", 1'000'000'000},
        {"time_ms", 1'000'000},
        {"time_us", 1'000},
        {"time_ns", 1},
        {"time", 1'000'000'000},
        {"timestamp", 1'000'000'000},
        {"timestamps", 1'000'000'000}}) {
    if (name == known) return unit_ns;
  }
  return std::nullopt;
}

std::vector<std::string_view> fields_of(std::string_view row) {
  std::vector<std::string_view> fields;
  while (true) {
    const std::size_t end = row.find_first_of(",; \t");
    fields.push_back(row.substr(0, end));
    if (end == std::string_view::npos) return fields;
    row.remove_prefix(end + 1);
  }
}

/// A row per pulse, or with a column `level` per edge, as `merkel inspect session --stream sync`
/// prints them.
Expected<PulseFile, SetupError> read_text_pulses(const std::string& path) {
  PulseFile file{.format = "times", .lines = {}};
  std::optional<std::int64_t> unit_ns;
  std::size_t line_column = 0;  // 0: none, because the first is the time
  std::size_t level_column = 0;
  const auto read = read_rows(path, [&](std::string_view row) -> const char* {
    const std::vector<std::string_view> fields = fields_of(row);
    if (!unit_ns) {
      unit_ns = unit_of_header(fields[0]);
      if (unit_ns) {
        for (std::size_t i = 1; i < fields.size(); ++i) {
          if (fields[i] == "line") line_column = i;
          if (fields[i] == "level") level_column = i;
        }
        return nullptr;
      }
      unit_ns = 1'000'000'000;
    }
    const auto time = parse_time(fields[0], *unit_ns);
    if (!time) {
      return "this is not the time of a pulse: expected a number in s in the first column, or a "
             "header time_s, time_ms, time_us or time_ns";
    }
    const auto number_in = [&](std::size_t column, double largest) -> std::optional<double> {
      if (column == 0) return 1.0;
      const auto number = column < fields.size() ? parse_number(fields[column]) : std::nullopt;
      return number >= 0.0 && number <= largest ? number : std::nullopt;
    };
    const auto line = number_in(line_column, UINT16_MAX);
    const auto level = number_in(level_column, 1.0);
    if (!line) return "its line is not a number from 0 to 65535";
    if (!level) return "its level is neither 0 nor 1";
    if (*level == 1.0) file.lines[static_cast<std::uint32_t>(*line)].push_back(*time);
    return nullptr;
  });
  if (!read) return Unexpected<SetupError>(read.error());
  return file;
}

/// The sample rate of a folder of events, as structure.oebin above it says; 0: it does not.
double rate_of_events(const Path& folder) {
  constexpr std::size_t kMaxBytes = std::size_t{1} << 24U;
  const Path whole = std::filesystem::absolute(folder).lexically_normal();
  for (Path above = whole.parent_path(); above != above.parent_path();
       above = above.parent_path()) {
    std::error_code ignored;
    const Path structure = above / "structure.oebin";
    if (!std::filesystem::is_regular_file(structure, ignored)) continue;
    const auto text = read_whole_file(structure.string(), "recording", kMaxBytes);
    const auto json = text ? nlohmann::json::parse(*text, nullptr, false) : nlohmann::json();
    if (!json.is_object() || !json.contains("events") || !json["events"].is_array()) return 0.0;
    for (const auto& each : json["events"]) {
      if (!each.is_object() || !each.contains("folder_name") || !each["folder_name"].is_string() ||
          !each.contains("sample_rate") || !each["sample_rate"].is_number()) {
        continue;
      }
      const Path named = above / "events" / each["folder_name"].get<std::string>();
      const auto no_slash = [](const Path& path) {
        std::string name = path.lexically_normal().string();
        while (name.ends_with('/')) name.pop_back();
        return name;
      };
      if (no_slash(named) == no_slash(whole)) return each["sample_rate"].get<double>();
    }
    return 0.0;
  }
  return 0.0;
}

Expected<PulseFile, SetupError> read_open_ephys(const Path& folder, const Path& times_file) {
  std::error_code ignored;
  const Path states_file = std::filesystem::exists(folder / "states.npy", ignored)
                               ? folder / "states.npy"
                               : folder / "channel_states.npy";  // before version 0.6
  const auto states = read_npy(states_file.string());
  if (!states) return Unexpected<SetupError>(states.error());
  const auto times = read_npy(times_file.string());
  if (!times) return Unexpected<SetupError>(times.error());
  if (times->values.size() != states->values.size()) {
    return bad_input(times_file.string() + " has " + std::to_string(times->values.size()) +
                     " values, but " + states_file.string() + " has " +
                     std::to_string(states->values.size()) + ": are they of one recording?");
  }
  double rate_Hz = 1.0;
  if (times->whole) {
    rate_Hz = rate_of_events(folder);
    if (!(rate_Hz > 0.0)) {
      return bad_input(times_file.string() +
                       " counts samples, and no structure.oebin above it gives their rate: keep "
                       "the folders of the recording together, or write the times in s into a CSV "
                       "file");
    }
  }
  PulseFile file{.format = "Open Ephys", .lines = {}};
  for (std::size_t i = 0; i < times->values.size(); ++i) {
    const double state = states->values[i];
    const auto time = time_of_s(times->values[i] / rate_Hz);
    if (!time || !(std::fabs(state) <= UINT16_MAX)) {
      return bad_input(times_file.string() + ": the event " + std::to_string(i + 1) +
                       " has an impossible time or state: the files are damaged");
    }
    if (state >= 1.0) file.lines[static_cast<std::uint32_t>(state)].push_back(*time);
  }
  return file;
}

Expected<PulseFile, SetupError> read_session_pulses(const std::string& path) {
  auto session = SessionReader::open(path);
  if (!session) return Unexpected<SetupError>(session.error());
  session->read_only({SessionStream::Id::kSync});
  PulseFile file{.format = "session", .lines = {}};
  const auto read = session->for_each([&](const SessionChunk& chunk) {
    for (const SyncEdge& edge : chunk.edges) {
      if (edge.level == 1) file.lines[edge.line].push_back(edge.time);
    }
  });
  if (!read) return Unexpected<SetupError>(read.error());
  return file;
}

}  // namespace

Expected<PulseFile, SetupError> read_pulse_file(const std::string& path) {
  std::error_code ignored;
  const Path file(path);
  const bool folder = std::filesystem::is_directory(file, ignored);
  auto read = [&]() -> Expected<PulseFile, SetupError> {
    if (folder) return read_open_ephys(file, file / "timestamps.npy");
    if (file.extension() == ".npy") return read_open_ephys(file.parent_path(), file);
    if (SessionSamples::is_session(path)) return read_session_pulses(path);
    return read_text_pulses(path);
  }();
  if (!read) return read;
  for (auto& [line, times] : read->lines) {
    std::sort(times.begin(), times.end());
    times.erase(std::unique(times.begin(), times.end()), times.end());
  }
  return read;
}

}  // namespace merkel
