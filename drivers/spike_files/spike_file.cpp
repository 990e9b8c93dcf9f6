#include "drivers/spike_files/spike_file.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "drivers/files/csv_text.hpp"
#include "drivers/files/input_file.hpp"
#include "drivers/files/line_reader.hpp"
#include "drivers/sessions/session_reader.hpp"
#include "drivers/sessions/session_samples.hpp"
#include "drivers/spike_files/recorded_zero.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

std::optional<std::uint32_t> neuron_of(std::string_view field) {
  std::uint32_t neuron = 0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), neuron);
  if (error != std::errc{} || end != field.data() + field.size() || neuron == 0)
    return std::nullopt;
  return neuron;
}

/// The rest of a file as numbers.
template <class Number>
Expected<std::vector<std::int64_t>, SetupError> numbers_of(std::ifstream& file,
                                                           const std::string& path) {
  std::vector<std::int64_t> values;
  Number number = 0;
  while (file.read(reinterpret_cast<char*>(&number), sizeof number)) {
    if (!std::in_range<std::int64_t>(number)) {
      return bad_input(path + " holds a number above 2^63");
    }
    values.push_back(static_cast<std::int64_t>(number));
  }
  return values;
}

/// The whole numbers of a one-dimensional NumPy file.
Expected<std::vector<std::int64_t>, SetupError> read_npy(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::array<char, 10> head{};
  if (!file.read(head.data(), head.size()) || std::memcmp(head.data(), "\x93NUMPY\x01", 7) != 0) {
    return bad_input("cannot read " + path + ": it is missing, or not a NumPy file");
  }
  ReadFiles::note(path);
  const std::size_t header_bytes =
      static_cast<unsigned char>(head[8]) + 256U * static_cast<unsigned char>(head[9]);
  std::string header(header_bytes, ' ');
  file.read(header.data(), static_cast<std::streamsize>(header_bytes));
  const auto is = [&header](const char* type) { return header.find(type) != std::string::npos; };
  // Kilosort and SpikeInterface write unsigned times.
  if (is("'<i8'")) return numbers_of<std::int64_t>(file, path);
  if (is("'<u8'")) return numbers_of<std::uint64_t>(file, path);
  if (is("'<i4'")) return numbers_of<std::int32_t>(file, path);
  if (is("'<u4'")) return numbers_of<std::uint32_t>(file, path);
  return bad_input(path + " does not hold whole numbers of 4 or 8 bytes");
}

}  // namespace

Expected<SpikeFile, SetupError> read_text_spikes(const std::string& path) {
  auto lines = LineReader::open(path);
  if (!lines) return Unexpected<SetupError>(lines.error());
  SpikeFile file{.format = "GDF", .spikes = {}};
  RecordedZero zero;
  LineReader::Outcome outcome = LineReader::Outcome::kEnd;
  while ((outcome = lines->next()) == LineReader::Outcome::kLine) {
    std::string_view line = lines->line();
    if (line.empty()) continue;
    if (line.starts_with('#')) continue;
    if (file.spikes.empty() && line.starts_with("time_s,neuron")) {
      file.format = "CSV";
      continue;
    }
    // NEST 3's recording backend "ascii"; its comment lines are skipped.
    if (file.spikes.empty() && line == "sender\ttime_ms") {
      file.format = "NEST";
      continue;
    }
    if (file.spikes.empty() && line.starts_with("sender\ttime_step")) {
      return bad_input(lines->where() +
                       "the times are in steps: record with NEST's time_in_steps = false");
    }
    const bool csv = file.format == "CSV";
    const auto tab = line.find('\t');
    const std::string_view time =
        csv ? take_field(line) : line.substr(tab == std::string_view::npos ? line.size() : tab + 1);
    std::optional<nanoseconds> spike_time;
    if (csv) {
      spike_time = parse_seconds(time);
    } else if (const auto ms = parse_number(time, 6); ms && std::fabs(*ms) < 4e18) {
      spike_time = nanoseconds{std::llround(*ms)};
    }
    const auto neuron = neuron_of(csv ? take_field(line) : line.substr(0, tab));
    if (!neuron || !spike_time) {
      return bad_input(
          lines->where() +
          "this is not a spike: expected a header time_s,neuron and rows of them (CSV), or "
          "rows of neuron, tab and ms (GDF, NEST)");
    }
    file.spikes.push_back({.time = *spike_time, .neuron = *neuron});
  }
  if (outcome == LineReader::Outcome::kError) return bad_input(lines->error());
  zero.take_file_beside(path);
  file.from_start = zero.apply(file.spikes);
  return file;
}

Expected<SpikeFile, SetupError> read_session_spikes(const std::string& path) {
  auto session = SessionReader::open(path);
  if (!session) return Unexpected<SetupError>(session.error());
  const auto origin = session_origin(*session);
  if (!origin) return Unexpected<SetupError>(origin.error());
  SpikeFile file{.format = "XDF", .spikes = {}, .from_start = true};
  SessionChunk chunk;
  for (;;) {
    const auto more = session->next(chunk);
    if (!more) return Unexpected<SetupError>(more.error());
    if (!*more) return file;
    for (const SpikeEvent& spike : chunk.spikes) {
      file.spikes.push_back({.time = spike.time - origin->start, .neuron = spike.neuron});
    }
  }
}

Expected<SpikeFile, SetupError> read_phy_spikes(const std::string& folder) {
  constexpr std::size_t kMaxBytes = std::size_t{1} << 20U;
  const std::string parameters =
      read_whole_file(folder + "/params.py", "parameters", kMaxBytes).value_or("");
  const auto rate_text = noted_value(parameters, "sample_rate");
  const auto rate_Hz = rate_text ? parse_number(*rate_text) : std::nullopt;
  if (!rate_Hz || !(*rate_Hz > 0.0)) {
    return bad_input(folder + "/params.py has no sample_rate: it is not a Phy folder");
  }
  const auto times = read_npy(folder + "/spike_times.npy");
  if (!times) return Unexpected<SetupError>(times.error());
  const auto clusters = read_npy(folder + "/spike_clusters.npy");
  if (!clusters) return Unexpected<SetupError>(clusters.error());
  SpikeFile file{.format = "Phy", .spikes = {}};
  for (std::size_t i = 0; i < std::min(times->size(), clusters->size()); ++i) {
    const double time_ns = static_cast<double>((*times)[i]) / *rate_Hz * 1e9;
    if (!(std::fabs(time_ns) < 4e18) || (*clusters)[i] < 1 || (*clusters)[i] > UINT32_MAX) {
      return bad_input(folder + ": spike " + std::to_string(i) +
                       " has an impossible time or cluster: the folder is damaged");
    }
    file.spikes.push_back({.time = nanoseconds{std::llround(time_ns)},
                           .neuron = static_cast<std::uint32_t>((*clusters)[i])});
  }
  RecordedZero zero;
  zero.take_all(parameters);
  file.from_start = zero.apply(file.spikes);
  return file;
}

#ifndef MERKEL_WITH_HDF5
Expected<SpikeFile, SetupError> read_hdf5_spikes(const std::string& path) {
  return bad_input(path +
                   ": this merkel was built without HDF5: install libhdf5-dev, then configure "
                   "and build merkel again");
}
#endif

Expected<SpikeFile, SetupError> read_spike_file(const std::string& path) {
  std::error_code ignored;
  const auto read = [&]() -> Expected<SpikeFile, SetupError> {
    if (std::filesystem::is_directory(path, ignored)) return read_phy_spikes(path);
    if (SessionSamples::is_session(path)) return read_session_spikes(path);
    std::array<char, 8> magic{};
    std::ifstream file;
    if (std::filesystem::is_regular_file(path, ignored)) file.open(path, std::ios::binary);
    if (file.read(magic.data(), magic.size()) &&
        std::memcmp(magic.data(), "\x89HDF\r\n\x1a\n", magic.size()) == 0) {
      return read_hdf5_spikes(path);
    }
    return read_text_spikes(path);
  };
  auto file = read();
  if (file) std::sort(file->spikes.begin(), file->spikes.end());
  return file;
}

}  // namespace merkel
