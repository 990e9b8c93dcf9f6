#include "drivers/sinks/nwb_file.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <string_view>

#include "drivers/files/csv_text.hpp"
#include "drivers/files/hdf5_file.hpp"
#include "drivers/files/line_reader.hpp"

namespace merkel {
namespace {

using Type = Hdf5File::Type;
using std::chrono::nanoseconds;

constexpr std::size_t kSpikesAtOnce = 4'000'000;  ///< in memory

/// A random UUID, as every object of NWB has one.
std::string new_uuid() {
  static constexpr std::string_view kDigits = "0123456789abcdef";
  std::random_device random;
  std::string text = "xxxxxxxx-xxxx-4xxx-yxxx-xxxxxxxxxxxx";
  for (char& c : text) {
    const unsigned digit = random() & 15U;
    if (c == 'x') c = kDigits[digit];
    if (c == 'y') c = kDigits[8U | (digit & 3U)];
  }
  return text;
}

/// "2026-01-31T12:00:00.000000+00:00".
std::string iso_time(nanoseconds since_1970) {
  const auto whole = std::chrono::floor<std::chrono::seconds>(since_1970);
  const std::time_t seconds = whole.count();
  std::tm utc{};
  ::gmtime_r(&seconds, &utc);
  std::array<char, 32> date{};
  std::strftime(date.data(), date.size(), "%Y-%m-%dT%H:%M:%S", &utc);
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%s.%06d+00:00", date.data(),
                static_cast<int>((since_1970 - whole).count() / 1000));
  return text.data();
}

void make_typed(Hdf5File& file, const std::string& path, const char* space, const char* type) {
  file.attribute(path, "namespace", std::string(space));
  file.attribute(path, "neurodata_type", std::string(type));
  file.attribute(path, "object_id", new_uuid());
}

/// A table of NWB: a group with columns of equal length.
class Table {
 public:
  Table(Hdf5File& file, std::string path, const char* type, const char* space,
        std::vector<std::string> columns, const std::string& description)
      : file_(file), path_(std::move(path)) {
    file_.group(path_);
    make_typed(file_, path_, space, type);
    file_.attribute(path_, "colnames", columns);
    file_.attribute(path_, "description", description);
    ids_ = std::make_unique<Hdf5File::Column>(file_, path_ + "/id", Type::kInt64);
    make_typed(file_, path_ + "/id", "hdmf-common", "ElementIdentifiers");
  }
  void add_row() { ids_->append(rows_++); }
  std::unique_ptr<Hdf5File::Column> column(const std::string& name, Type type,
                                           const std::string& description, std::size_t width = 1) {
    auto made = std::make_unique<Hdf5File::Column>(file_, path_ + "/" + name, type, width);
    describe(name, "VectorData", description);
    return made;
  }
  /// Where the values of each row end in another column.
  std::unique_ptr<Hdf5File::Column> index_of(const std::string& name) {
    const std::string index = name + "_index";
    auto made = std::make_unique<Hdf5File::Column>(file_, path_ + "/" + index, Type::kUint32);
    describe(index, "VectorIndex", "Index of " + name);
    file_.reference(path_ + "/" + index, "target", path_ + "/" + name);
    return made;
  }
  void texts(const std::string& name, const std::vector<std::string>& values,
             const std::string& description) {
    file_.texts(path_ + "/" + name, values);
    describe(name, "VectorData", description);
  }

 private:
  void describe(const std::string& name, const char* type, const std::string& description) {
    make_typed(file_, path_ + "/" + name, "hdmf-common", type);
    file_.attribute(path_ + "/" + name, "description", description);
  }

  Hdf5File& file_;
  std::string path_;
  std::unique_ptr<Hdf5File::Column> ids_;
  std::uint64_t rows_ = 0;
};

/// A stretch of time with a label.
struct Interval {
  double start_s = 0.0;
  double stop_s = 0.0;
  std::string label;
  double subject = 0.0;
};

void write_intervals(Hdf5File& file, const char* name, const char* description,
                     const std::vector<Interval>& intervals, const char* label,
                     const char* subject) {
  if (intervals.empty()) return;
  std::vector<std::string> columns = {"start_time", "stop_time", label};
  if (subject != nullptr) columns.emplace_back(subject);
  Table table(file, std::string("/intervals/") + name, "TimeIntervals", "core", columns,
              description);
  const auto start = table.column("start_time", Type::kDouble, "Start, in seconds");
  const auto stop = table.column("stop_time", Type::kDouble, "End, in seconds");
  const auto of = subject == nullptr
                      ? nullptr
                      : table.column(subject, Type::kDouble, "Probe from 0, or neuron from 1");
  std::vector<std::string> labels;
  for (const Interval& each : intervals) {
    table.add_row();
    start->append(each.start_s);
    stop->append(each.stop_s);
    if (of) of->append(each.subject);
    labels.push_back(each.label);
  }
  table.texts(label, labels, "What it is");
}

/// The samples of one probe: a time series for each channel, and when it touched.
class ProbeSeries {
 public:
  ProbeSeries(Hdf5File& file, const NwbContent::OfProbe& probe, std::size_t number, bool alone) {
    for (const NwbContent::Channel& channel : probe.channels) {
      std::string name = channel.name;
      std::replace(name.begin(), name.end(), '/', '_');
      const std::string path = "/stimulus/presentation/" +
                               (alone ? name : "probe_" + std::to_string(number) + "_" + name);
      file.group(path);
      make_typed(file, path, "core", "TimeSeries");
      file.attribute(path, "description", channel.meaning);
      file.attribute(path, "comments", "measured by " + probe.name);
      values_.push_back(std::make_unique<Hdf5File::Column>(file, path + "/data", Type::kDouble));
      file.attribute(path + "/data", "unit", channel.unit);
      file.attribute(path + "/data", "conversion", channel.conversion);
      file.attribute(path + "/data", "resolution", -1.0F);
      file.attribute(path + "/data", "offset", 0.0F);
      times_.push_back(
          std::make_unique<Hdf5File::Column>(file, path + "/timestamps", Type::kDouble));
      file.attribute(path + "/timestamps", "unit", std::string("seconds"));
      file.attribute(path + "/timestamps", "interval", std::int32_t{1});
      presses_.push_back(channel.name == "depth" || channel.name == "force");
    }
    number_ = number;
  }
  /// False where the row has other fields.
  bool add(double time_s, std::string_view row, std::vector<Interval>& contacts) {
    bool touches = false;
    for (std::size_t i = 0; i < values_.size(); ++i) {
      const auto value = parse_number(take_field(row));
      if (!value) return false;
      values_[i]->append(*value);
      times_[i]->append(time_s);
      touches = touches || (presses_[i] && *value > 0.0);
    }
    if (touches && !touched_) touched_ = time_s;
    if (!touches) end_contact(time_s, contacts);
    return row.empty();
  }
  void end_contact(double time_s, std::vector<Interval>& contacts) {
    if (!touched_) return;
    contacts.push_back({.start_s = *touched_,
                        .stop_s = time_s,
                        .label = "contact",
                        .subject = static_cast<double>(number_)});
    touched_.reset();
  }

 private:
  std::vector<std::unique_ptr<Hdf5File::Column>> values_;
  std::vector<std::unique_ptr<Hdf5File::Column>> times_;
  std::vector<bool> presses_;
  std::size_t number_ = 0;
  std::optional<double> touched_;  ///< since when
};

template <class Whole>
bool take_whole(std::string_view& row, Whole& value) {
  const std::string_view field = take_field(row);
  return std::from_chars(field.data(), field.data() + field.size(), value).ec == std::errc{};
}

/// What one reading of all rows finds.
struct Findings {
  std::vector<std::uint64_t> spikes_of;  ///< by neuron, from 0
  std::vector<Interval> contacts;
  std::vector<Interval> marks;
  std::vector<Interval> events;
  double first_s = 0.0;
  double last_s = 0.0;
};

/// Calls `take` with the letter, the time and the rest of each row. False where a row cannot be
/// read.
bool for_each_row(const std::string& path,
                  const std::function<bool(char, double, std::string_view)>& take) {
  auto lines = LineReader::open(path);
  if (!lines) return false;
  LineReader::Outcome outcome = LineReader::Outcome::kEnd;
  while ((outcome = lines->next()) == LineReader::Outcome::kLine) {
    std::string_view row = lines->line();
    if (row.empty() || row.front() == '#') continue;
    const std::string_view letter = take_field(row);
    const auto time_s = parse_number(take_field(row));
    if (letter.size() != 1 || !time_s || !take(letter.front(), *time_s, row)) return false;
  }
  return outcome == LineReader::Outcome::kEnd;
}

/// Reads all rows and writes the samples.
bool write_stimulus(Hdf5File& file, const NwbContent& content, Findings& found) {
  std::vector<std::unique_ptr<ProbeSeries>> series;
  for (const NwbContent::OfProbe& probe : content.probes) {
    series.push_back(
        std::make_unique<ProbeSeries>(file, probe, series.size(), content.probes.size() == 1));
  }
  found.spikes_of.assign(content.afferents.size(), 0);
  std::optional<double> first_s;
  const bool read =
      for_each_row(content.rows, [&](char letter, double time_s, std::string_view row) {
        first_s = std::min(first_s.value_or(time_s), time_s);
        found.last_s = std::max(found.last_s, time_s);
        std::size_t number = 0;
        Interval event{.start_s = time_s, .stop_s = time_s, .label = {}};
        switch (letter) {
          case 's':
            if (!take_whole(row, number) || number == 0 || number > found.spikes_of.size())
              return false;
            ++found.spikes_of[number - 1];
            return true;
          case 'p':
            return take_whole(row, number) && number < series.size() &&
                   series[number]->add(time_s, row, found.contacts);
          case 'm':
            event.label = row;
            found.marks.push_back(event);
            return true;
          case 'e': {
            const auto length_s = parse_number(take_field(row));
            const auto subject = parse_number(take_field(row));
            if (!length_s || !subject) return false;
            event.stop_s += *length_s;
            event.subject = *subject;
            event.label = row;
            found.events.push_back(event);
            return true;
          }
          default:
            return false;
        }
      });
  found.first_s = first_s.value_or(0.0);
  for (const auto& each : series) each->end_contact(found.last_s, found.contacts);
  return read;
}

/// The spike times, unit by unit: the rows are read again for as many units as fit into memory.
bool write_spike_times(const NwbContent& content, const Findings& found,
                       Hdf5File::Column& spike_times) {
  std::size_t first = 0;
  while (first < found.spikes_of.size()) {
    std::size_t last = first;
    std::uint64_t spikes = 0;
    while (last < found.spikes_of.size() &&
           (last == first || spikes + found.spikes_of[last] <= kSpikesAtOnce)) {
      spikes += found.spikes_of[last++];
    }
    std::vector<std::vector<double>> times(last - first);
    for (std::size_t i = first; i < last; ++i) times[i - first].reserve(found.spikes_of[i]);
    const bool read = spikes == 0 || for_each_row(content.rows, [&](char letter, double time_s,
                                                                    std::string_view row) {
                        if (letter != 's') return true;
                        std::size_t number = 0;
                        if (!take_whole(row, number)) return false;
                        if (number > first && number <= last)
                          times[number - 1 - first].push_back(time_s);
                        return true;
                      });
    if (!read) return false;
    for (const auto& train : times) {
      for (const double time_s : train) spike_times.append(time_s);
    }
    first = last;
  }
  return true;
}

bool write_units(Hdf5File& file, const NwbContent& content, const Findings& found) {
  Table table(
      file, "/units", "Units", "core",
      {"spike_times", "obs_intervals", "x_mm", "y_mm", "field_radius_mm", "patch"},
      "simulated slowly adapting type I afferents, numbered from 0 in the order of merkel's "
      "neurons 1, 2, …");
  const auto spike_times = table.column("spike_times", Type::kDouble, "Spike times, in seconds");
  const auto spike_ends = table.index_of("spike_times");
  const auto observed =
      table.column("obs_intervals", Type::kDouble, "When the afferent was simulated", 2);
  const auto observed_ends = table.index_of("obs_intervals");
  const auto x =
      table.column("x_mm", Type::kDouble, "Middle of the receptive field, along the finger, mm");
  const auto y =
      table.column("y_mm", Type::kDouble, "Middle of the receptive field, across it, mm");
  const auto radius =
      table.column("field_radius_mm", Type::kDouble, "Radius of the receptive field, mm");
  const auto patch = table.column("patch", Type::kUint32, "Patch of skin, from 0");
  std::uint64_t end = 0;
  for (std::size_t i = 0; i < content.afferents.size(); ++i) {
    const AfferentRow& row = content.afferents[i];
    table.add_row();
    end += found.spikes_of[i];
    spike_ends->append(end);
    observed->append(found.first_s);
    observed->append(found.last_s);
    observed_ends->append(static_cast<std::uint64_t>(i + 1));
    x->append(row.x_mm);
    y->append(row.y_mm);
    radius->append(row.field_radius_mm);
    patch->append(std::uint64_t{row.patch});
  }
  return write_spike_times(content, found, *spike_times);
}

void write_head(Hdf5File& file, const NwbContent& content) {
  make_typed(file, "/", "core", "NWBFile");
  file.attribute("/", "nwb_version", std::string("2.7.0"));
  file.text("/identifier", new_uuid());
  file.text("/session_description", content.description);
  file.text("/session_start_time", iso_time(content.start));
  file.text("/timestamps_reference_time", iso_time(content.zero));
  const std::array<std::string, 1> now = {
      iso_time(std::chrono::system_clock::now().time_since_epoch())};
  file.texts("/file_create_date", now);
  for (const char* const group : {"/acquisition", "/analysis", "/processing",
                                  "/stimulus/presentation", "/stimulus/templates", "/general"}) {
    file.group(group);
  }
  file.text("/general/notes", content.notes);
  file.text("/general/source_script", content.scene_text);
  file.attribute("/general/source_script", "file_name", content.scene);
  for (std::size_t i = 0; i < content.probes.size(); ++i) {
    const std::string device = "/general/devices/probe_" + std::to_string(i);
    file.group(device);
    make_typed(file, device, "core", "Device");
    file.attribute(device, "description", content.probes[i].name);
  }
}

/// From mark to mark; the last ends with the recording. Without marks the contacts.
std::vector<Interval> trials_of(const Findings& found) {
  std::vector<Interval> trials = found.marks.empty() ? found.contacts : found.marks;
  for (std::size_t i = 0; i < found.marks.size(); ++i) {
    const bool last = i + 1 == found.marks.size();
    trials[i].stop_s =
        std::max(trials[i].start_s, last ? found.last_s : found.marks[i + 1].start_s);
  }
  return trials;
}

}  // namespace

Expected<void, std::string> write_nwb(const std::string& path, const NwbContent& content,
                                      bool overwrite) {
  return write_hdf5_file(path, overwrite, [&](Hdf5File& file) {
    write_head(file, content);
    Findings found;
    if (!write_stimulus(file, content, found)) return file.fail();
    if (!content.afferents.empty() && !write_units(file, content, found)) return file.fail();
    write_intervals(file, "trials", "from mark to mark; without marks, the contacts",
                    trials_of(found), "label", nullptr);
    write_intervals(file, "contacts", "times in which a probe touched the skin", found.contacts,
                    "label", "probe");
    write_intervals(file, "events", "outages, gaps of the simulation, neurons reset", found.events,
                    "kind", "subject");
  });
}

}  // namespace merkel
