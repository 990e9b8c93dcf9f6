#pragma once

#include <cstdint>
#include <vector>

#include "core/parameters/parameter_error.hpp"
#include "core/receptors/patch.hpp"
#include "core/receptors/receptor_placement.hpp"

namespace merkel {

/// How the receptors of a patch are shared out among its afferents.
enum class ReceptorLayout : std::uint8_t {
  kSubregions,  ///< the paper's: receptors by the density law, one afferent a subregion
  kFields,      ///< afferents by the density law, each with a receptive field of its own
};

/// The receptive field of an afferent: a disc of receptors around its centre.
struct ReceptiveField {
  std::int64_t receptors = 28;  ///< MCNCs of an afferent
  double radius_mm = 1.0;

  [[nodiscard]] static FieldTable fields();
  [[nodiscard]] Expected<void, ParameterError> check(const Patch& patch) const;
};

/// Where the centre of an afferent's receptive field is.
using FieldCentre = Position;

/// The receptors of afferents with given centres, numbered from 1 in their order: each on a Vogel
/// spiral, r_k = radius·√((k+½)/n), θ_k = k·π(3−√5), which fills the disc evenly. Fields at the
/// patch's edge reach beyond it by up to their radius: the skin goes on there.
/// Fails where a centre is outside the patch. Real-time: no.
[[nodiscard]] Expected<std::vector<Receptor>, ParameterError> place_fields(
    const ReceptiveField& field, const std::vector<FieldCentre>& centres, const Patch& patch);

/// Centres that follow the density law: the density and count of `placement` are those of afferents
/// (450 on the default patch). Real-time: no.
[[nodiscard]] Expected<std::vector<FieldCentre>, ParameterError> place_centres(
    const ReceptorParameters& placement, const Patch& patch);

}  // namespace merkel
