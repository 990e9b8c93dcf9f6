#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/parameters/parameter_error.hpp"
#include "core/units.hpp"
#include "drivers/files/csv_text.hpp"
#include "drivers/printable_text.hpp"
#include "drivers/sinks/afferent_json.hpp"
#include "drivers/sinks/nwb_file.hpp"
#include "drivers/sinks/rows_sink.hpp"
#include "drivers/sinks/sink_openers.hpp"

namespace merkel {

// The description of a run at the head of its rows, as JSON.
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(NwbContent::Channel, name, unit, conversion, meaning)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(NwbContent::Probe, name, channels)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(NwbContent::Electrode, name, description)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(NwbContent, scene, scene_text, notes, general, probes,
                                   electrodes, afferents, patches)

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

NwbContent::Probe describe(const ProbeInfo& info) {
  NwbContent::Probe probe{.name = info.name.empty() ? info.uri : info.name, .channels = {}};
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

NwbContent::Electrode describe(const Electrode& electrode, const StimulationParameters& limits) {
  return {.name = electrode.name,
          .description = "field of radius " + shortest_decimal(electrode.field_mm[2]) +
                         " mm around x = " + shortest_decimal(electrode.field_mm[0]) +
                         " mm, y = " + shortest_decimal(electrode.field_mm[1]) + " mm on patch " +
                         std::to_string(electrode.patch) + "; one phase lasts " +
                         shortest_decimal(units::us_from(limits.phase)) + " µs"};
}

NwbContent content_of(const SinkSetup& setup, NwbContent content, std::string rows) {
  content.rows = std::move(rows);
  for (const ProbeInfo& info : setup.run.probes) content.probes.push_back(describe(info));
  for (const Electrode& electrode : setup.run.encoding.electrodes) {
    content.electrodes.push_back(describe(electrode, setup.run.encoding.stimulation));
  }
  content.afferents = afferents_of(setup);
  for (const PatchParameters& patch : setup.run.model.patches) {
    const std::string number = "patch " + std::to_string(content.patches.size());
    content.patches.push_back(patch.name.empty() ? number : printable_text(patch.name));
  }
  content.scene = setup.run.scene;
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

/// Rows of NwbContent: NWB groups spikes by unit, which are known at the end only.
class NwbSink final : public RowsSink {
 public:
  NwbSink(std::string uri, OutputFile rows, TimeBase time, const SinkSetup& setup,
          NwbContent content)
      : RowsSink(std::move(uri), std::move(rows), time, setup.overwrite, "the run is"),
        content_(content_of(setup, std::move(content), this->rows())),
        probes_(setup.run.probes) {}

  [[nodiscard]] std::uint32_t subscriptions() const noexcept override {
    return kKinds<SpikeEvent, DeliveredSample, LoopEvent, Mark> |
           (content_.electrodes.empty() ? 0U : kKinds<StimulationCommand>);
  }

  [[nodiscard]] Expected<void, SinkError> write(const RecordBatch& batch) override {
    text_.clear();
    for (const DeliveredSample& item : batch.samples) add(item);
    for (const SpikeEvent& spike : batch.spikes) {
      begin_row('s', spike.time);
      text_ += "," + std::to_string(spike.neuron) + "\n";
    }
    for (const StimulationCommand& command : batch.commands) add(command);
    for (const LoopEvent& event : batch.events) {
      begin_row('e', event.time);
      text_ += ",";
      append_seconds(text_, event.length);
      text_ += "," + std::to_string(event.subject) + ",";
      text_.append(name_of(event.kind)).append("\n");
    }
    for (const Mark& mark : batch.marks) {
      begin_row('m', mark.time);
      text_ += "," + printable_text(mark.label) + "\n";
    }
    return write_rows(text_, batch.spikes.size());
  }

 private:
  void add(const DeliveredSample& item) {
    if (item.probe >= probes_.size()) return;
    const ProbeInfo& info = probes_[item.probe];
    const ProbeSample& sample = item.sample;
    begin_row('p', sample.time);
    text_ += "," + std::to_string(item.probe);
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
  void add(const StimulationCommand& command) {
    begin_row('c', command.time);
    text_ += "," + std::to_string(command.electrode) + ",";
    text_.append(name_of(command.kind)).append(",");
    text_ += shortest_decimal(command.amplitude_uA) + ",";
    text_ += shortest_decimal(command.frequency_Hz) + ",";
    text_ += std::to_string(static_cast<int>(command.stop)) + "\n";
  }
  [[nodiscard]] std::string head(const RunOrigin& origin) override {
    set_time(origin, time().offset(), content_);
    for (const auto& [name, value] : time().facts()) content_.notes += name + " = " + value + "\n";
    return content_lines(content_);
  }
  [[nodiscard]] Expected<void, std::string> convert(const std::string& path,
                                                    bool overwrite) override {
    return write_nwb(path, content_, overwrite);
  }
  void begin_row(char letter, nanoseconds at) {
    text_ += letter;
    text_ += ',';
    append_seconds(text_, time()(at));
  }

  NwbContent content_;
  std::vector<ProbeInfo> probes_;
  std::string text_;
};

}  // namespace

void convert_recovered_nwb(const std::string& recovered, const SinkSetup& setup) {
  RowsSink::convert_recovered(recovered, "the data of the run is", setup,
                              [&](const RowsSink::Recovered& run) {
                                auto content = run.content.get<NwbContent>();
                                content.rows = run.rows;
                                set_time(run.origin, run.offset, content);
                                return write_nwb(recovered, content, false);
                              });
}

OpenedSink open_nwb_sink(const Uri& uri, const SinkSetup& setup) {
  UriOptions options(uri);
  const TimeBase time = TimeBase::read(options, setup);
  NwbContent content;
  for (const std::string_view name : kNwbFacts) {
    if (std::string value = options.text(name, ""); !value.empty()) {
      content.general.emplace_back(name, printable_text(value));
    }
  }
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  auto rows = RowsSink::open_rows(uri, setup);
  if (!rows) return Unexpected<SetupError>(rows.error());
  if (!rows->recovered().empty()) convert_recovered_nwb(rows->recovered(), setup);
  return std::make_unique<NwbSink>(uri.text, std::move(*rows), time, setup, std::move(content));
}

}  // namespace merkel
