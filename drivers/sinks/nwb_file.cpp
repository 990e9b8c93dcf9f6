#include "drivers/sinks/nwb_file.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <string_view>
#include <utility>

#include "core/units.hpp"
#include "drivers/files/hdf5_file.hpp"
#include "drivers/printable_text.hpp"
#include "drivers/sinks/nwb_objects.hpp"
#include "drivers/sinks/nwb_series.hpp"

namespace merkel {
namespace {

using nwb::Interval;
using nwb::Table;
using Type = Hdf5File::Type;
using std::chrono::nanoseconds;

constexpr std::size_t kSpikesAtOnce = 4'000'000;  ///< in memory

void write_intervals(Hdf5File& file, const char* name, const char* description,
                     std::vector<Interval> intervals, const char* label, const char* subject) {
  if (intervals.empty()) return;
  // nwbinspector's check_time_intervals and check_table_time_columns: in order.
  std::stable_sort(intervals.begin(), intervals.end(),
                   [](const Interval& a, const Interval& b) { return a.start_s < b.start_s; });
  std::vector<std::string> columns = {"start_time", "stop_time", label};
  if (subject != nullptr) columns.emplace_back(subject);
  Table table(file, std::string("/intervals/") + name, "TimeIntervals", nwb::kCore, columns,
              description);
  const auto start = table.column("start_time", Type::kDouble, "Start, in seconds");
  const auto stop = table.column("stop_time", Type::kDouble, "End, in seconds");
  std::vector<std::string> labels;
  std::vector<std::string> subjects;
  for (Interval& each : intervals) {
    table.add_row();
    start->append(each.start_s);
    stop->append(each.stop_s);
    labels.push_back(std::move(each.label));
    subjects.push_back(std::move(each.subject));
  }
  table.texts(label, labels, "Kind or label");
  // Texts: nwbinspector's check_column_binary_capability takes the numbers 0 and 1 for a truth
  // value.
  if (subject == nullptr) return;
  table.texts(subject, subjects, "Device (probe_0, …) or neuron (neuron_1, …)");
}

std::vector<std::string> parts_of(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::string_view rest = text;
  for (;;) {
    const auto end = rest.find(separator);
    parts.emplace_back(rest.substr(0, end));
    if (end == std::string_view::npos) return parts;
    rest.remove_prefix(end + 1);
  }
}

/// The result of reading the journal once.
struct NwbTotals {
  std::vector<std::uint64_t> spikes_of;  ///< by neuron, from 0
  std::vector<Interval> contacts;
  std::vector<Interval> marks;
  std::vector<Interval> events;
  std::vector<Interval> pulses;
};

/// What was simulated.
struct Extent {
  nanoseconds begin = nanoseconds::max();  ///< of the first tick
  nanoseconds end = nanoseconds::min();    ///< of the last one
};

/// The file being written, and what it is made from.
struct Source {
  const NwbContent& content;
  const TimeBase& time;
  RunJournal& journal;
  std::vector<Extent> of_units = {};   ///< of the run of each afferent
  std::vector<Extent> of_probes = {};  ///< of the run of each probe
  Extent whole = {};                   ///< of all runs
};

/// The ticks of a run; of a session without ticks, its samples, spikes and commands. Empty at
/// `zero` if it has none of them.
Extent extent_of(const RunJournal::Part& run, nanoseconds zero, Hdf5File& file) {
  Extent ticks;
  Extent records;
  const auto widen = [](Extent& extent, const auto& list) {
    for (const auto& each : list) {
      extent.begin = std::min(extent.begin, time_of(each));
      extent.end = std::max(extent.end, time_of(each));
    }
  };
  file.take(run.journal.read([&](const RecordBatch& batch) {
    widen(ticks, batch.ticks);
    widen(records, batch.samples);
    widen(records, batch.spikes);
    widen(records, batch.commands);
    return true;
  }));
  if (ticks.begin <= ticks.end) {
    ticks.begin -= run.tick;
    return ticks;
  }
  return records.begin <= records.end ? records : Extent{.begin = zero, .end = zero};
}

/// Reads when each run of the journal was simulated.
void read_extents(Hdf5File& file, Source& source) {
  const NwbContent& content = source.content;
  std::vector<RunJournal::Part> runs = source.journal.parts();
  if (runs.empty()) {
    runs.push_back({.journal = source.journal,
                    .tick = content.run.model.tick,
                    .neurons = content.afferents.size(),
                    .probes = content.run.probes.size()});
  }
  for (const RunJournal::Part& run : runs) {
    const Extent extent = extent_of(run, source.time.offset(), file);
    source.of_units.insert(source.of_units.end(), run.neurons, extent);
    source.of_probes.insert(source.of_probes.end(), run.probes, extent);
    source.whole.begin = std::min(source.whole.begin, extent.begin);
    source.whole.end = std::max(source.whole.end, extent.end);
  }
  source.of_units.resize(content.afferents.size(), source.whole);
  source.of_probes.resize(content.run.probes.size(), source.whole);
}

/// Pulses from their begin to their end.
class PulseIntervals {
 public:
  explicit PulseIntervals(std::vector<Interval>& pulses) : pulses_(pulses) {}
  void add(double time_s, const SyncEdge& edge) {
    auto begun = begun_.extract({edge.probe, edge.line});
    if (edge.level == 1) {
      begun_[{edge.probe, edge.line}] = time_s;
    } else if (begun) {
      pulses_.push_back({.start_s = begun.mapped(),
                         .stop_s = time_s,
                         .label = "line " + std::to_string(edge.line),
                         .subject = nwb::name_of_probe(edge.probe)});
    }
  }

 private:
  std::vector<Interval>& pulses_;
  std::map<std::pair<std::uint32_t, std::uint16_t>, double> begun_;
};

/// Reads the whole journal and writes the samples and the stimulation commands.
void write_stimulus(Hdf5File& file, const Source& source, NwbTotals& found) {
  const NwbContent& content = source.content;
  nwb::SeriesPaths paths("/stimulus/presentation");
  // The electrodes first: their names are known, those of columns are not.
  const auto series_of = [&](nwb::ElectrodeSeries::Of of) {
    std::vector<std::unique_ptr<nwb::ElectrodeSeries>> all;
    const EncodingParameters& encoding = content.run.encoding;
    for (const Electrode& each : encoding.electrodes) {
      all.push_back(
          std::make_unique<nwb::ElectrodeSeries>(file, paths, each, encoding.stimulation, of));
    }
    return all;
  };
  const auto electrodes = series_of(nwb::ElectrodeSeries::Of::kCommanded);
  const auto sent = series_of(nwb::ElectrodeSeries::Of::kSent);
  std::vector<std::unique_ptr<nwb::ProbeSeries>> probes;
  for (const ProbeInfo& probe : content.run.probes) {
    probes.push_back(std::make_unique<nwb::ProbeSeries>(file, paths, probe, probes.size(),
                                                        content.run.probes.size() == 1));
  }
  found.spikes_of.assign(content.afferents.size(), 0);
  const auto time_s = [&](const auto& record) { return source.time.s(time_of(record)); };
  PulseIntervals pulses(found.pulses);
  file.take(source.journal.read([&](const RecordBatch& batch) {
    for (const SyncEdge& edge : batch.edges) pulses.add(source.time.s(edge.time), edge);
    for (const DeliveredSample& item : batch.samples) {
      if (item.probe >= probes.size()) continue;
      const Extent& extent = source.of_probes[item.probe];
      if (item.sample.time < extent.begin || item.sample.time > extent.end) continue;
      probes[item.probe]->add(time_s(item), item, found.contacts);
    }
    for (const SpikeEvent& spike : batch.spikes) {
      if (spike.neuron - 1 < found.spikes_of.size()) ++found.spikes_of[spike.neuron - 1];
    }
    for (const StimulationCommand& command : batch.commands) {
      if (command.electrode >= electrodes.size()) continue;
      electrodes[command.electrode]->add(time_s(command), command, {});
    }
    for (const SentCommand& item : batch.sent) {
      const std::size_t e = item.command.electrode;
      if (e >= sent.size() || item.refused_by != 0) continue;
      sent[e]->add(time_s(item), item.command, item.sent);
    }
    for (const LoopEvent& event : batch.events) {
      const double start_s = source.time.s(event.begin());
      found.events.push_back({.start_s = start_s,
                              .stop_s = start_s + units::s_from(event.length),
                              .label = std::string(name_of(event.kind)),
                              .subject = event.kind == LoopEvent::Kind::kNeuronReset
                                             ? "neuron_" + std::to_string(event.subject)
                                             : nwb::name_of_probe(event.subject)});
    }
    for (const Mark& mark : batch.marks) {
      const double at_s = time_s(mark);
      found.marks.push_back({.start_s = at_s, .stop_s = at_s, .label = printable_text(mark.label)});
    }
    return file.ok();
  }));
  for (std::size_t i = 0; i < probes.size(); ++i) {
    probes[i]->end_contact(source.time.s(source.of_probes[i].end), found.contacts);
  }
}

/// The spike times, unit by unit: the journal is read again for as many units as fit into memory.
void write_spike_times(Hdf5File& file, const Source& source, const NwbTotals& found,
                       Hdf5File::Column& spike_times) {
  std::size_t first = 0;
  while (first < found.spikes_of.size() && file.ok()) {
    std::size_t last = first;
    std::uint64_t spikes = 0;
    while (last < found.spikes_of.size() &&
           (last == first || spikes + found.spikes_of[last] <= kSpikesAtOnce)) {
      spikes += found.spikes_of[last++];
    }
    std::vector<std::vector<double>> times(last - first);
    for (std::size_t i = first; i < last; ++i) times[i - first].reserve(found.spikes_of[i]);
    if (spikes > 0) {
      file.take(source.journal.read([&](const RecordBatch& batch) {
        for (const SpikeEvent& spike : batch.spikes) {
          if (spike.neuron > first && spike.neuron <= last) {
            times[spike.neuron - 1 - first].push_back(source.time.s(spike.time));
          }
        }
        return true;
      }));
    }
    for (const auto& train : times) {
      for (const double time_s : train) spike_times.append(time_s);
    }
    first = last;
  }
}

void write_units(Hdf5File& file, const Source& source, const NwbTotals& found) {
  const NwbContent& content = source.content;
  Table table(
      file, "/units", "Units", nwb::kCore,
      {"spike_times", "obs_intervals", "x_mm", "y_mm", "field_radius_mm", "patch_name"},
      "simulated slowly adapting type I afferents, numbered from 0 in the order of merkel's "
      "neurons 1, 2, …");
  const auto spike_times = table.column("spike_times", Type::kDouble, "Spike times, in seconds");
  // Times are written to the nanosecond; SpikeInterface takes the clock's period from here.
  file.attribute("/units/spike_times", "resolution", 1e-9);
  const auto spike_ends = table.index_of("spike_times");
  const auto observed =
      table.column("obs_intervals", Type::kDouble, "When the afferent was simulated", 2);
  const auto observed_ends = table.index_of("obs_intervals");
  const auto x =
      table.column("x_mm", Type::kDouble, "Centre of the receptive field, along the finger, mm");
  const auto y =
      table.column("y_mm", Type::kDouble, "Centre of the receptive field, across it, mm");
  const auto radius =
      table.column("field_radius_mm", Type::kDouble, "Radius of the receptive field, mm");
  std::uint64_t end = 0;
  for (std::size_t i = 0; i < content.afferents.size(); ++i) {
    const AfferentRow& row = content.afferents[i];
    table.add_row();
    end += found.spikes_of[i];
    spike_ends->append(end);
    observed->append(source.time.s(source.of_units[i].begin));
    observed->append(source.time.s(source.of_units[i].end));
    observed_ends->append(static_cast<std::uint64_t>(i + 1));
    x->append(row.x_mm);
    y->append(row.y_mm);
    radius->append(row.field_radius_mm);
  }
  std::vector<std::string> names;
  for (const AfferentRow& row : content.afferents) {
    const auto& patches = content.run.model.patches;
    const bool named = row.patch < patches.size() && !patches[row.patch].name.empty();
    names.push_back(named ? printable_text(patches[row.patch].name)
                          : "patch " + std::to_string(row.patch));
  }
  table.texts("patch_name", names, "Name of the patch of skin");
  write_spike_times(file, source, found, *spike_times);
}

/// What the user states about the experiment.
void write_general(Hdf5File& file, const NwbContent& content) {
  bool subject = false;
  for (const auto& [name, value] : content.general) {
    if (name == "experimenter" || name == "keywords") {
      const std::vector<std::string> texts = parts_of(value, ';');
      file.texts("/general/" + name, texts);
    } else if (name == "institution" || name == "lab" || name == "experiment_description") {
      file.text("/general/" + name, value);
    } else {
      if (!std::exchange(subject, true)) {
        file.group("/general/subject");
        nwb::make_typed(file, "/general/subject", nwb::kCore, "Subject");
        file.text("/general/subject/description",
                  "model of slowly adapting type I afferents, simulated by merkel");
      }
      file.text("/general/subject/" + name, value);
    }
  }
}

void write_head(Hdf5File& file, const NwbContent& content, const TimeBase& time) {
  nwb::make_typed(file, "/", nwb::kCore, "NWBFile");
  file.attribute("/", "nwb_version", std::string("2.7.0"));
  file.text("/identifier", nwb::new_uuid());
  file.text("/session_description", "merkel run of the scene " + content.run.scene);
  file.text("/session_start_time", nwb::iso_time(time.origin().utc));
  file.text("/timestamps_reference_time",
            nwb::iso_time(time.origin().utc + (time.offset() - time.origin().start)));
  const std::array<std::string, 1> now = {
      nwb::iso_time(std::chrono::system_clock::now().time_since_epoch())};
  file.texts("/file_create_date", now);
  for (const char* const group : {"/acquisition", "/analysis", "/processing",
                                  "/stimulus/presentation", "/stimulus/templates", "/general"}) {
    file.group(group);
  }
  std::string notes;  // the other facts of the run
  std::string scene_text;
  for (const auto& [name, value] : content.run.facts) {
    if (name == "scene_text") {
      scene_text = value;
    } else if (name != "start_device_ns" && name != "start_utc_ns") {  // TimeBase::facts() has them
      notes += name + " = " + value + "\n";
    }
  }
  for (const auto& [name, value] : time.facts()) notes += name + " = " + value + "\n";
  file.text("/general/notes", notes);
  file.text("/general/source_script", scene_text);
  file.attribute("/general/source_script", "file_name", content.run.scene);
  write_general(file, content);
  for (std::size_t i = 0; i < content.run.probes.size(); ++i) {
    const std::string device = "/general/devices/" + nwb::name_of_probe(i);
    file.group(device);
    nwb::make_typed(file, device, nwb::kCore, "Device");
    file.attribute(device, "description", content.run.probes[i].title());
  }
}

/// From mark to mark; the last ends with the recording. Without marks the contacts.
std::vector<Interval> trials_of(const NwbTotals& found, double end_s) {
  std::vector<Interval> trials = found.marks.empty() ? found.contacts : found.marks;
  for (std::size_t i = 0; i < found.marks.size(); ++i) {
    const bool last = i + 1 == found.marks.size();
    trials[i].stop_s = std::max(trials[i].start_s, last ? end_s : found.marks[i + 1].start_s);
  }
  return trials;
}

}  // namespace

Expected<void, std::string> write_nwb(const std::string& path, const NwbContent& content,
                                      const TimeBase& time, RunJournal& journal, bool overwrite) {
  return write_hdf5_file(path, overwrite, [&](Hdf5File& file) {
    Source source{.content = content, .time = time, .journal = journal};
    read_extents(file, source);
    write_head(file, content, time);
    NwbTotals found;
    write_stimulus(file, source, found);
    if (!file.ok()) return;
    if (!content.afferents.empty()) write_units(file, source, found);
    write_intervals(file, "trials", "from mark to mark; without marks, the contacts",
                    trials_of(found, time.s(source.whole.end)), "label", nullptr);
    write_intervals(file, "contacts", "contacts of a probe with the skin", found.contacts, "label",
                    "probe");
    write_intervals(file, "sync", "pulses of the sync lines of the devices", found.pulses, "line",
                    "probe");
    write_intervals(file, "events",
                    "outages, gaps of the simulation, neurons reset; resume and zero_certain with "
                    "the time that they end",
                    found.events, "kind", "subject");
  });
}

}  // namespace merkel
