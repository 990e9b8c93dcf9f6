#include "drivers/sinks/view/view_scene.hpp"

#include <cmath>
#include <vector>

#include "core/records/stimulation_command.hpp"
#include "core/scene/patch_layout.hpp"
#include "core/units.hpp"
#include "drivers/sinks/session_position.hpp"
#include "drivers/sinks/view/json_writer.hpp"
#include "drivers/sinks/view/view_frames.hpp"

namespace merkel {
namespace {

constexpr std::size_t kMostReceptors = 15'000;  ///< most receptors sent per patch

/// Rounded to 0.01 mm, finer than a screen pixel.
std::string place(double mm) { return JsonWriter::number_of(std::round(mm * 100.0) / 100.0); }

std::string list_of(const std::vector<double>& values) {
  JsonWriter list('[');
  for (const double value : values) list.item(JsonWriter::number_of(value));
  return list.end();
}

/// A patch, its receptors, and the centre of each afferent, by number.
std::string json_of(const PatchParameters& parameters) {
  const PatchLayout layout = layout_of(parameters).value_or(PatchLayout{});
  const std::vector<Receptor>& receptors = layout.receptors;
  // Evenly thinned out if there are too many for a picture.
  const std::size_t stride = receptors.size() / kMostReceptors + 1;
  JsonWriter dots('[');
  for (std::size_t i = 0; i < receptors.size(); i += stride) {
    dots.item(JsonWriter('[')
                  .item(place(receptors[i].x_mm))
                  .item(place(receptors[i].y_mm))
                  .item(std::to_string(receptors[i].neuron))
                  .end());
  }
  JsonWriter centres('[');
  for (const AfferentSite& site : layout.afferents) {
    centres.item(JsonWriter('[').item(place(site.x_mm)).item(place(site.y_mm)).end());
  }
  const bool fields = parameters.layout == ReceptorLayout::kFields;
  return JsonWriter()
      .text("name", parameters.name)
      .number("length_mm", parameters.patch.length_mm)
      .number("width_mm", parameters.patch.width_mm)
      .number("columns", parameters.patch.columns)
      .number("rows", parameters.patch.rows)
      .number("field_radius_mm", fields ? parameters.field.radius_mm : 0.0)
      .raw("thinned", stride > 1 ? "true" : "false")
      .raw("receptors", dots.end())
      .raw("centres", centres.end())
      .end();
}

std::string json_of(const Indenter& indenter) {
  JsonWriter json;
  json.number("patch", static_cast<double>(indenter.patch));
  switch (indenter.tip) {
    case Indenter::Tip::kSphere:
      json.text("tip", "sphere").number("radius_mm", indenter.radius_mm);
      break;
    case Indenter::Tip::kBars:
      json.text("tip", "bars").number("bar_length_mm", indenter.bars.length_mm);
      json.raw("bar_widths_mm", list_of(indenter.bars.widths_mm));
      json.raw("bar_gaps_mm", list_of(indenter.bars.gaps_mm));
      break;
    case Indenter::Tip::kPin:
      json.text("tip", "pin").number("diameter_mm", indenter.pin.diameter_mm);
      break;
  }
  return json.end();
}

}  // namespace

std::string view_scene_json(const SinkSetup& setup, bool control) {
  const RunDescription& run = setup.run;
  const NeuronKind kind = run.model.kind();
  const bool volts = kind != NeuronKind::kIntegrateAndFire;
  JsonWriter json;
  json.text("scene", run.scene).number("neurons", setup.neurons);
  json.number("tick_ms", units::ms_from(run.model.tick));
  json.raw("control", control ? "true" : "false");
  if (setup.session) {
    json.raw("session", JsonWriter().number("length_s", setup.session->length_s).end());
  }
  json.text("drive_unit", kind == NeuronKind::kHodgkinHuxley ? "\u00b5A/cm\u00b2" : "Hz");
  json.text("potential_name", volts ? "potential" : "state")
      .text("potential_unit", volts ? "mV" : "");
  JsonWriter counters('[');
  const auto add_counter = [&](std::string_view name, std::string_view unit,
                               std::string_view meaning, bool fault) {
    counters.item(JsonWriter()
                      .text("name", name)
                      .text("unit", unit)
                      .text("meaning", meaning)
                      .raw("fault", fault ? "true" : "false")
                      .end());
  };
  for (const auto& field : kRunCounterFields<>) {
    add_counter(field.name, field.unit, field.meaning, field.fault);
  }
  add_counter("page_lost", "", "spikes and points that this page did not receive", true);
  json.raw("counters", counters.end());
  JsonWriter patches('[');
  for (const PatchParameters& patch : run.model.patches) patches.item(json_of(patch));
  json.raw("patches", patches.end());
  JsonWriter probes('[');
  for (const Indenter& indenter : run.model.indenters) probes.item(json_of(indenter));
  json.raw("probes", probes.end());
  JsonWriter electrodes('[');
  for (const Electrode& electrode : run.encoding.electrodes) {
    electrodes.item(JsonWriter()
                        .text("name", electrode.name)
                        .raw("amplitude_uA", list_of(electrode.amplitude_uA))
                        .raw("frequency_Hz", list_of(electrode.frequency_Hz))
                        .end());
  }
  json.raw("electrodes", electrodes.end());
  JsonWriter stops('[');
  for (auto stop = StimulationCommand::Stop::kNone; stop <= StimulationCommand::Stop::kEnd;
       stop = static_cast<StimulationCommand::Stop>(static_cast<int>(stop) + 1)) {
    stops.item(json_string(name_of(stop)));
  }
  json.raw("stops", stops.end());
  JsonWriter facts('[');
  for (const auto& [name, value] : run.facts) {
    facts.item(JsonWriter('[').item(json_string(name)).item(json_string(value)).end());
  }
  return json.raw("facts", facts.end()).end();
}

}  // namespace merkel
