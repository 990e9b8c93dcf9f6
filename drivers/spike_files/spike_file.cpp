#include "drivers/spike_files/spike_file.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string_view>
#include <system_error>

#include "drivers/files/csv_text.hpp"
#include "drivers/files/input_file.hpp"
#include "drivers/files/line_reader.hpp"
#include "drivers/parsed_number.hpp"
#include "drivers/sessions/session_reader.hpp"
#include "drivers/sessions/session_samples.hpp"
#include "drivers/spike_files/recorded_zero.hpp"

namespace merkel {

Expected<SpikeFile, SetupError> read_csv_spikes(const std::string& path) {
  SpikeFile file{.format = "CSV", .spikes = {}};
  RecordedZero zero;
  const auto read = read_rows(path, [&](std::string_view row) -> const char* {
    if (file.spikes.empty() && row.starts_with("time_s,neuron")) return nullptr;
    const auto time = parse_seconds(take_field(row));
    const auto neuron = parsed_number<std::uint32_t>(take_field(row));
    if (neuron.value_or(0) == 0 || !time) {
      return "this is not a spike: expected a header time_s,neuron and rows of them";
    }
    file.spikes.push_back({.time = *time, .neuron = *neuron});
    return nullptr;
  });
  if (!read) return Unexpected<SetupError>(read.error());
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
  const auto read = session->for_each([&](const SessionChunk& chunk) {
    for (const SpikeEvent& spike : chunk.spikes) {
      file.spikes.push_back({.time = spike.time - origin->start, .neuron = spike.neuron});
    }
  });
  if (!read) return Unexpected<SetupError>(read.error());
  return file;
}

#if !MERKEL_WITH_HDF5
Expected<SpikeFile, SetupError> read_nwb_spikes(const std::string& path) {
  return bad_input(path +
                   ": this merkel was built without HDF5: install libhdf5-dev, then configure "
                   "and build merkel again");
}
#endif

Expected<SpikeFile, SetupError> read_spike_file(const std::string& path) {
  std::error_code ignored;
  const auto read = [&]() -> Expected<SpikeFile, SetupError> {
    if (SessionSamples::is_session(path)) return read_session_spikes(path);
    std::array<char, 8> magic{};
    std::ifstream file;
    if (std::filesystem::is_regular_file(path, ignored)) file.open(path, std::ios::binary);
    if (file.read(magic.data(), magic.size()) &&
        std::memcmp(magic.data(), "\x89HDF\r\n\x1a\n", magic.size()) == 0) {
      return read_nwb_spikes(path);
    }
    return read_csv_spikes(path);
  };
  auto file = read();
  if (file) std::sort(file->spikes.begin(), file->spikes.end());
  return file;
}

}  // namespace merkel
