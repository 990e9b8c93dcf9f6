#pragma once

#include "core/parameters/field.hpp"
#include "core/scene/model_parameters.hpp"

namespace merkel {

/// The parameters of [receptors], borrowed from a patch.
[[nodiscard]] BoundFields receptor_fields(PatchParameters& patch);
/// `tip` of [probe]. Setting another kind selects its default tip, and invalidates tip_fields().
[[nodiscard]] BoundFields tip_kind_field(Indenter& indenter);
/// The other parameters of [probe] that belong to its tip, which depend on its kind.
[[nodiscard]] BoundFields tip_fields(Indenter& indenter);
/// The parameter of [loop] that belongs to the model: tick_us.
[[nodiscard]] BoundFields tick_fields(ModelParameters& model);
/// `kind` of [neuron]. Setting another kind selects its default afferent and step, and invalidates
/// neuron_fields().
[[nodiscard]] BoundFields neuron_kind_fields(ModelParameters& model);
/// The other parameters of [neuron], which depend on its kind.
[[nodiscard]] BoundFields neuron_fields(ModelParameters& model);

}  // namespace merkel
