#include <array>
#include <charconv>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <sys/stat.h>

#include "core/units.hpp"
#include "drivers/files/csv_text.hpp"
#include "drivers/files/file_rename.hpp"
#include "drivers/files/line_reader.hpp"
#include "drivers/files/output_file.hpp"
#include "drivers/printable_text.hpp"
#include "drivers/sinks/afferent_table.hpp"
#include "drivers/sinks/nwb_file.hpp"
#include "drivers/sinks/sink_openers.hpp"
#include "drivers/sinks/time_base.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

/// A channel of samples, and how its value stands in a row.
struct ChannelOf {
  std::uint32_t bit;
  NwbContent::Channel channel;
};

const std::vector<ChannelOf>& known_channels() {
  static const std::vector<ChannelOf> channels = {
      {ProbeSample::kDepth, {"depth", "meters", 1e-3F, "indentation depth, in mm"}},
      {ProbeSample::kForce, {"force", "newtons", 1.0F, "normal force, in N"}},
      {ProbeSample::kX, {"x", "meters", 1e-3F, "position on the patch along the finger, in mm"}},
      {ProbeSample::kY, {"y", "meters", 1e-3F, "position on the patch across the finger, in mm"}}};
  return channels;
}

NwbContent::OfProbe describe(const ProbeInfo& info) {
  NwbContent::OfProbe probe{.name = info.name.empty() ? info.uri : info.name, .channels = {}};
  for (const ChannelOf& each : known_channels()) {
    if ((info.channels & each.bit) != 0U) probe.channels.push_back(each.channel);
  }
  for (const std::string& name : info.extra_columns) {
    probe.channels.push_back({.name = name,
                              .unit = "unknown",
                              .conversion = 1.0F,
                              .meaning = "a column of the recording, not used by the model"});
  }
  return probe;
}

NwbContent content_of(const SinkSetup& setup, std::string rows) {
  NwbContent content;
  content.rows = std::move(rows);
  for (const ProbeInfo& info : setup.run.probes) content.probes.push_back(describe(info));
  content.afferents = afferents_of(setup);
  content.scene = setup.run.scene;
  content.description = "merkel run of the scene " + setup.run.scene;
  for (const auto& [name, value] : setup.run.facts) {
    if (name == "scene_text") {
      content.scene_text = value;
    } else {
      content.notes += name + " = " + value + "\n";
    }
  }
  return content;
}

/// Sets the file's origin of time: probe time = time in the file + offset.
void set_time(const RunOrigin& origin, nanoseconds offset, NwbContent& content) {
  content.start = origin.utc;
  content.zero = origin.utc + (offset - origin.start);
}

/// The same from the facts at the head of rows that a killed run has left.
void set_time_of_rows(NwbContent& content) {
  auto lines = LineReader::open(content.rows);
  RunOrigin origin;
  nanoseconds offset{0};
  const auto take = [](std::string_view line, std::string_view name, nanoseconds& value) {
    if (!line.starts_with(name)) return;
    std::int64_t count = 0;
    line.remove_prefix(name.size());
    std::from_chars(line.data(), line.data() + line.size(), count);
    value = nanoseconds{count};
  };
  while (lines && lines->next() == LineReader::Outcome::kLine && lines->line().starts_with("#")) {
    take(lines->line(), "# time_offset_ns=", offset);
    take(lines->line(), "# start_device_ns=", origin.start);
    take(lines->line(), "# start_utc_ns=", origin.utc);
  }
  set_time(origin, offset, content);
}

/// Collects the run as rows of text in FILE.nwb.part, which nothing can damage, and makes the HDF5
/// file of them when the run is over: NWB groups spikes by unit.
class NwbSpikeSink final : public SpikeSink {
 public:
  NwbSpikeSink(std::string uri, OutputFile rows, TimeBase time, const SinkSetup& setup)
      : uri_(std::move(uri)),
        rows_(std::move(rows)),
        path_(rows_.path()),
        time_(time),
        content_(content_of(setup, rows_.part())),
        probes_(setup.run.probes),
        overwrite_(setup.overwrite) {}

  [[nodiscard]] const std::string& uri() const noexcept override { return uri_; }
  [[nodiscard]] std::uint32_t subscriptions() const noexcept override {
    return kSamples | kEvents | kMarks;
  }

  [[nodiscard]] Expected<void, SinkError> begin(const RunOrigin& origin) override {
    if (std::exchange(started_, true)) return {};
    time_.set(origin);
    set_time(origin, time_.offset(), content_);
    std::string head;
    for (const auto& [name, value] : time_.facts()) {
      head += "# " + name + "=" + value + "\n";
      content_.notes += name + " = " + value + "\n";
    }
    const bool written = rows_.write(head);
    rows_.end_header();
    return settle(written);
  }

  [[nodiscard]] Expected<void, SinkError> write(std::span<const SpikeEvent> spikes) override {
    text_.clear();
    for (const SpikeEvent& spike : spikes) {
      begin_row('s', spike.time);
      text_ += "," + std::to_string(spike.neuron) + "\n";
    }
    taken_ += spikes.size();
    return write_rows();
  }

  [[nodiscard]] Expected<void, SinkError> write_samples(
      std::size_t probe, std::span<const ProbeSample> samples) override {
    text_.clear();
    if (probe >= probes_.size()) return {};
    const ProbeInfo& info = probes_[probe];
    for (const ProbeSample& sample : samples) {
      begin_row('p', sample.time);
      text_ += "," + std::to_string(probe);
      const std::array<std::pair<std::uint32_t, std::string>, 4> values = {
          {{ProbeSample::kDepth, shifted_decimal(sample.depth_mm, 0)},
           {ProbeSample::kForce, shifted_decimal(sample.force_mN, -3)},
           {ProbeSample::kX, shifted_decimal(sample.x_mm, 0)},
           {ProbeSample::kY, shifted_decimal(sample.y_mm, 0)}}};
      for (const auto& [bit, value] : values) {
        if ((info.channels & bit) != 0U) text_ += "," + value;
      }
      for (std::size_t i = 0; i < info.extra_columns.size(); ++i) {
        text_ += "," + shifted_decimal(sample.extra[i], 0);
      }
      text_ += "\n";
    }
    return write_rows();
  }

  [[nodiscard]] Expected<void, SinkError> write_events(std::span<const LoopEvent> events) override {
    text_.clear();
    for (const LoopEvent& event : events) {
      begin_row('e', event.time);
      text_ += ",";
      append_seconds(text_, event.length);
      text_ += "," + std::to_string(event.subject) + ",";
      text_.append(name_of(event.kind)).append("\n");
    }
    return write_rows();
  }

  [[nodiscard]] Expected<void, SinkError> write_marks(std::span<const Mark> marks) override {
    text_.clear();
    for (const Mark& mark : marks) {
      begin_row('m', mark.time);
      text_ += "," + printable_text(mark.label) + "\n";
    }
    return write_rows();
  }

  [[nodiscard]] Expected<void, SinkError> flush() override { return settle(rows_.flush()); }

  [[nodiscard]] Expected<void, SinkError> close() override {
    if (auto started = begin({}); !started) return started;
    if (auto flushed = flush(); !flushed) return flushed;
    if (auto written = write_nwb(path_, content_, overwrite_); !written) {
      return Unexpected<SinkError>({.sentence = written.error() + "; the run is in " +
                                                rows_.part() +
                                                ", as text: free some space, and run again"});
    }
    rows_.remove();
    return {};
  }

  [[nodiscard]] std::uint64_t delivered() const noexcept override { return delivered_; }

 private:
  void begin_row(char letter, nanoseconds time) {
    text_ += letter;
    text_ += ',';
    append_seconds(text_, time_(time));
  }
  Expected<void, SinkError> write_rows() {
    if (auto started = begin({}); !started) return started;
    return settle(rows_.write(text_));
  }
  Expected<void, SinkError> settle(bool succeeded) {
    if (!succeeded) return Unexpected<SinkError>({.sentence = rows_.error()});
    if (rows_.settled()) delivered_ = taken_;
    return {};
  }

  std::string uri_;
  OutputFile rows_;
  std::string path_;
  TimeBase time_;
  NwbContent content_;
  std::vector<ProbeInfo> probes_;
  bool overwrite_;
  bool started_ = false;
  std::string text_;
  std::uint64_t taken_ = 0;
  std::uint64_t delivered_ = 0;
};

}  // namespace

void convert_recovered_nwb(const Uri& /*uri*/, const std::string& recovered,
                           const SinkSetup& setup) {
  NwbContent content = content_of(setup, recovered + ".part");
  if (rename_without_replacing(recovered, content.rows) != 0) return;
  set_time_of_rows(content);
  const auto written = write_nwb(recovered, content, false);
  if (written) {
    static_cast<void>(std::remove(content.rows.c_str()));
  } else if (setup.notice) {
    setup.notice(written.error() + "; what the run left is in " + content.rows + ", as text");
  }
}

OpenedSink open_nwb_sink(const Uri& uri, const SinkSetup& setup) {
  UriOptions options(uri);
  const TimeBase time = TimeBase::read(options, setup);
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  struct stat status {};
  if (uri.path == "-" || (::stat(uri.path.c_str(), &status) == 0 && !S_ISREG(status.st_mode) &&
                          !S_ISDIR(status.st_mode))) {
    return bad_input("\"" + uri.text + "\": HDF5 is written to regular files only");
  }
  auto rows = OutputFile::create(uri.path, setup.overwrite, setup.notice);
  if (!rows) return Unexpected<SetupError>(rows.error());
  if (!rows->recovered().empty()) convert_recovered_nwb(uri, rows->recovered(), setup);
  return std::make_unique<NwbSpikeSink>(uri.text, std::move(*rows), time, setup);
}

}  // namespace merkel
