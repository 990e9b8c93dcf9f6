#include "core/scene/model_fields.hpp"

#include <optional>
#include <string_view>
#include <variant>

namespace merkel {
namespace {

constexpr std::string_view kLayouts[] = {"subregions", "fields"};

FieldPointer kind_in(void* model) {
  return Choice{model,
                [](const void* p) -> std::optional<std::size_t> {
                  return static_cast<std::size_t>(static_cast<const ModelParameters*>(p)->kind());
                },
                [](void* p, std::size_t index) {
                  auto& parameters = *static_cast<ModelParameters*>(p);
                  const auto kind = static_cast<NeuronKind>(index);
                  if (kind != parameters.kind()) set_kind(parameters, kind);
                }};
}

constexpr Field kTick[] = {
    {"tick_us", "µs", {.low = 1.0, .high = 1e6}, "length of a tick", at<&ModelParameters::tick>}};
constexpr Field kKind[] = {{"kind", "", one_of(kNeuronKinds),
                            "model of the neurons; the other keys depend on it", kind_in}};
constexpr Field kStep[] = {{"step_us",
                            "µs",
                            {.low = 0.1, .high = 1e6},
                            "step of the neurons; divides the tick",
                            at<&ModelParameters::step>}};

}  // namespace

FieldTable PatchParameters::fields() {
  using Q = PatchParameters;
  static constexpr Field kFields[] = {
      {"name", "", any_value(),
       "name by which a [[probe]] selects this patch; with that of one of the preset's patches, the "
       "defaults of the other keys are its values, else those of the first",
       at<&Q::name>},
      {"layout", "", one_of(kLayouts),
       "one afferent per subregion (the paper), or afferents with their own receptive fields",
       at<&Q::layout>},
      {"centres_mm", "mm", from_to(-1e4, 1e4),
       "[[x, y], …]: centres of the receptive fields; [] places them by the density law",
       at<&Q::centres>}};
  return {"receptors", kFields};
}

FieldTable AccuracyParameters::fields() {
  static constexpr Field kFields[] = {
      {"cull_tolerance", "", from_below(0.0, 1.0),
       "skip receptors whose current the press changes by less than this fraction of "
       "alpha_uA_per_cm2; 0 skips none",
       at<&AccuracyParameters::cull_tolerance>},
      {"freeze_resting", "", any_value(), "skip neurons that are at rest",
       at<&AccuracyParameters::freeze_resting>}};
  return {"accuracy", kFields};
}

BoundFields receptor_fields(PatchParameters& patch) {
  BoundFields fields = bind_fields(patch);
  bind_fields(patch.receptors, fields);
  bind_fields(patch.patch, fields);
  bind_fields(patch.field, fields);
  return fields;
}

BoundFields tip_kind_field(Indenter& indenter) {
  BoundFields fields;
  bind_fields(Indenter::tip_field(), &indenter, fields);
  return fields;
}

BoundFields tip_fields(Indenter& indenter) {
  BoundFields fields;
  std::visit([&](auto& tip) { bind_fields(tip, fields); }, indenter.tip);
  if (indenter.sphere() == nullptr) bind_fields(indenter, fields);
  if (indenter.taxels() == nullptr) bind_fields(indenter.surface, fields);
  return fields;
}

BoundFields tick_fields(ModelParameters& model) {
  BoundFields fields;
  bind_fields({"loop", kTick}, &model, fields);
  return fields;
}

BoundFields neuron_kind_fields(ModelParameters& model) {
  BoundFields fields;
  bind_fields({"neuron", kKind}, &model, fields);
  return fields;
}

BoundFields neuron_fields(ModelParameters& model) {
  BoundFields fields;
  bind_fields({"neuron", kStep}, &model, fields);
  std::visit([&](auto& afferent) { afferent.bind(fields); }, model.afferent);
  return fields;
}

}  // namespace merkel
