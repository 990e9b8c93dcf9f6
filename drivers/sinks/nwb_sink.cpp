#include <array>
#include <string>
#include <utility>
#include <vector>

#include "core/parameters/parameter_error.hpp"
#include "core/units.hpp"
#include "drivers/printable_text.hpp"
#include "drivers/sample_channels.hpp"
#include "drivers/sinks/export_sink.hpp"
#include "drivers/sinks/nwb_file.hpp"

namespace merkel {

namespace {

constexpr std::array<const char*, kProbeChannels.size()> kNwbMeanings = {
    "indentation depth, in mm", "normal force, in N",
    "position on the patch along the finger, in mm",
    "position on the patch across the finger, in mm"};

NwbContent::Probe describe(const ProbeInfo& info) {
  NwbContent::Probe probe{.name = info.name.empty() ? info.uri : info.name, .channels = {}};
  for (std::size_t i = 0; i < kProbeChannels.size(); ++i) {
    const SampleChannel& channel = kProbeChannels[i];
    if (!channel.in(info.channels)) continue;
    const bool force = channel.bit == ProbeSample::kForce;
    probe.channels.push_back({.name = std::string(channel.name),
                              .unit = force ? "newtons" : "meters",
                              .conversion = force ? 1.0F : 1e-3F,
                              .meaning = kNwbMeanings[i],
                              .press = &channel});
  }
  for (std::size_t i = 0; i < info.extra_columns.size(); ++i) {
    probe.channels.push_back({.name = info.extra_columns[i],
                              .unit = "unknown",
                              .meaning = "the column \"" + info.extra_columns[i] +
                                         "\" of the recording, not used by the model",
                              .extra = i});
  }
  return probe;
}

NwbContent::Electrode describe(const Electrode& electrode, const StimulationParameters& scene) {
  return {
      .name = electrode.name,
      .description = "field of radius " + shortest_decimal(electrode.field_mm[2]) +
                     " mm around x = " + shortest_decimal(electrode.field_mm[0]) +
                     " mm, y = " + shortest_decimal(electrode.field_mm[1]) + " mm on patch " +
                     std::to_string(electrode.patch) + "; one phase lasts " +

                     shortest_decimal(units::us_from(ElectrodeLimits::of(electrode, scene).phase)) +
                     " µs"};
}

NwbContent content_of(const SinkSetup& setup, NwbContent content) {
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
  content.tick = setup.run.model.tick;
  for (const auto& [name, value] : setup.run.facts) {
    if (name == "scene_text") {
      content.scene_text = value;
    } else if (name != "start_device_ns" && name != "start_utc_ns") {  // TimeBase::facts() has them
      content.notes += name + " = " + value + "\n";
    }
  }
  return content;
}

}  // namespace

OpenedSink open_nwb_sink(const Uri& uri, const SinkSetup& setup) {
  UriOptions options(uri);
  TimeBase time = TimeBase::read(options, setup);
  NwbContent content;
  for (const std::string_view name : kNwbFacts) {
    if (std::string value = options.text(name, ""); !value.empty()) {
      content.general.emplace_back(name, printable_text(value));
    }
  }
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  return ExportSink::open(
      uri, setup,
      [path = uri.path, content = content_of(setup, std::move(content)), time,
       overwrite = setup.overwrite](RunJournal& journal, const RunOrigin& origin) mutable {
        time.set(origin);
        content.start = origin.utc;
        content.zero = origin.utc + (time.offset() - origin.start);
        for (const auto& [name, value] : time.facts()) {
          content.notes += name + " = " + value + "\n";
        }
        return write_nwb(path, content, time, journal, overwrite);
      });
}

}  // namespace merkel
