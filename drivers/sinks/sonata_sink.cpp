#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "drivers/files/hdf5_file.hpp"
#include "drivers/files/output_file.hpp"
#include "drivers/sessions/afferent_table.hpp"
#include "drivers/sinks/export_sink.hpp"

namespace merkel {
namespace {

using Type = Hdf5File::Type;

constexpr std::uint32_t kMagic = 0x0A7A;  ///< of every SONATA file
constexpr std::array<std::uint32_t, 2> kVersion{0, 1};
constexpr std::array<const char*, 3> kSorting{"none", "by_id", "by_time"};

struct SonataContent {
  std::string population;
  std::vector<AfferentRow> afferents = {};
};

/// The name of the table of node types: "dir/s_node_types.csv" for "dir/s.h5".
std::string node_types_name(const std::string& path) {
  const auto end = path.ends_with(".h5") ? path.size() - 3 : path.size();
  return path.substr(0, end) + "_node_types.csv";
}

void write_spikes(Hdf5File& file, const SonataContent& content, const TimeBase& time,
                  RunJournal& journal) {
  const std::string group = "/spikes/" + content.population;
  file.group(group);
  file.word(group, "sorting", kSorting, 2);
  for (const auto& [name, value] : time.facts()) file.attribute(group, name.c_str(), value);
  Hdf5File::Column timestamps(file, group + "/timestamps", Type::kDouble);
  Hdf5File::Column node_ids(file, group + "/node_ids", Type::kUint64);
  file.attribute(group + "/timestamps", "units", std::string("ms"));
  file.take(journal.read([&](const RecordBatch& batch) {
    for (const SpikeEvent& spike : batch.spikes) {
      timestamps.append(time.ms(spike.time));
      node_ids.append(std::uint64_t{spike.neuron} - 1);
    }
    return file.ok();
  }));
}

/// The table of node types, which SONATA's readers want with the file of nodes:
/// NAME_node_types.csv.
Expected<void, std::string> write_node_types(const std::string& path, const SonataContent& content,
                                             bool overwrite) {
  if (content.afferents.empty()) return {};
  auto file = OutputFile::create(node_types_name(path), overwrite);
  if (!file) return Unexpected<std::string>(file.error().sentence);
  if (file->write("node_type_id population model_type\n0 " + content.population + " virtual\n") &&
      file->close()) {
    return {};
  }
  return Unexpected<std::string>(file->error());
}

/// The afferents, as SONATA describes nodes: one type, one group of attributes.
void write_nodes(Hdf5File& file, const SonataContent& content) {
  if (content.afferents.empty()) return;
  const std::string group = "/nodes/" + content.population;
  Hdf5File::Column node_id(file, group + "/node_id", Type::kUint64);
  Hdf5File::Column node_type_id(file, group + "/node_type_id", Type::kUint64);
  Hdf5File::Column node_group_id(file, group + "/node_group_id", Type::kUint64);
  Hdf5File::Column node_group_index(file, group + "/node_group_index", Type::kUint64);
  Hdf5File::Column x(file, group + "/0/x", Type::kDouble);
  Hdf5File::Column y(file, group + "/0/y", Type::kDouble);
  Hdf5File::Column field_radius_mm(file, group + "/0/field_radius_mm", Type::kDouble);
  Hdf5File::Column patch(file, group + "/0/patch", Type::kDouble);
  for (const AfferentRow& row : content.afferents) {
    node_id.append(std::uint64_t{row.number} - 1);
    node_type_id.append(std::uint64_t{0});
    node_group_id.append(std::uint64_t{0});
    node_group_index.append(std::uint64_t{row.number} - 1);
    x.append(1e3 * row.x_mm);  // SONATA's positions are in µm
    y.append(1e3 * row.y_mm);
    field_radius_mm.append(row.field_radius_mm);
    patch.append(static_cast<double>(row.patch));
  }
}

/// Writes a SONATA file: /spikes/<population> with timestamps in ms and node_ids from 0, and
/// /nodes/<population> with positions and field radii of the afferents; beside it the table of node
/// types. The facts of `time` are attributes of the population. Uses bounded memory. On failure,
/// leaves no incomplete file and returns the reason.
Expected<void, std::string> write_sonata(const std::string& path, const SonataContent& content,
                                         const TimeBase& time, RunJournal& journal,
                                         bool overwrite) {
  auto written = write_hdf5_file(path, overwrite, [&](Hdf5File& file) {
    file.attribute("/", "magic", kMagic);
    file.attribute("/", "version", kVersion);
    write_spikes(file, content, time, journal);
    write_nodes(file, content);
  });
  return written ? write_node_types(path, content, overwrite) : written;
}

}  // namespace

OpenedSink open_sonata_sink(const Uri& uri, const SinkSetup& setup) {
  UriOptions options(uri);
  SonataContent content{.population = options.text("population", "merkel"),
                        .afferents = afferents_of(setup)};
  const TimeBase zero = TimeBase::read(options, setup);
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  if (content.population.empty() ||
      content.population.find_first_of("/.\" \t") != std::string::npos) {
    return bad_input("\"" + uri.text +
                     "\": the option population must be a name without /, ., quotes and blanks");
  }
  if (auto free = check_writable(node_types_name(uri.path), setup.overwrite); !free) {
    return Unexpected<SetupError>(free.error());
  }
  return ExportSink::open(uri, setup, zero,
                          [path = uri.path, content = std::move(content),
                           overwrite = setup.overwrite](auto& journal, const TimeBase& time) {
                            return write_sonata(path, content, time, journal, overwrite);
                          });
}

}  // namespace merkel
