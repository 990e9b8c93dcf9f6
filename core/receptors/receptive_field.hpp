#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/parameters/parameter_error.hpp"
#include "core/receptors/patch.hpp"
#include "core/receptors/receptor_placement.hpp"

namespace merkel {

/// How the receptors of a patch are assigned to its afferents.
enum class ReceptorLayout : std::uint8_t {
  kSubregions,  ///< as in the paper: receptors by the density law, one afferent per subregion
  kFields,      ///< afferents by the density law, each with its own receptive field
};

/// The receptive field of an afferent: a disc of receptors around its centre.
struct ReceptiveField {
  std::int64_t receptors = 28;  ///< MCNCs per afferent
  double radius_mm = 1.0;       ///< the median, with a spread
  double radius_spread = 0.0;   ///< standard deviation of ln(radius) between afferents
  /// Share of the receptors within a part ρ of the radius: ρ^(1/q). ½: an even disc; more: a dense
  /// core with a sparse periphery. A multiple of ¼.
  double concentration = 0.5;

  [[nodiscard]] static FieldTable fields();
  [[nodiscard]] Expected<void, ParameterError> check(const Patch& patch) const;
};

/// The centre of an afferent's receptive field.
using FieldCentre = Position;

/// The radius of each afferent's field, mm, at most half of the patch's shorter side.
[[nodiscard]] std::vector<double> field_radii(const ReceptiveField& field, std::size_t afferents,
                                              std::uint64_t seed, const Patch& patch);

/// The receptors of afferents with given centres and radii (from field_radii()), numbered from 1 in
/// their order: each on a Vogel spiral, r_k = radius·((k+½)/n)^q, θ_k = k·π(3−√5), with q the
/// concentration; ½ fills the disc evenly. Fields extend beyond the patch's edge, as the skin does.
/// Fails if a centre is outside the patch. Real-time: no.
[[nodiscard]] Expected<std::vector<Receptor>, ParameterError> place_fields(
    const ReceptiveField& field, const std::vector<FieldCentre>& centres,
    const std::vector<double>& radii_mm, const Patch& patch);

/// Places centres by the density law. The density and count of `placement` refer to afferents (450
/// on the default patch). Real-time: no.
[[nodiscard]] Expected<std::vector<FieldCentre>, ParameterError> place_centres(
    const ReceptorParameters& placement, const Patch& patch);

}  // namespace merkel
