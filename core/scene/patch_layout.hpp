#pragma once

#include <cstddef>
#include <vector>

#include "core/parameters/parameter_error.hpp"
#include "core/receptors/receptor_placement.hpp"
#include "core/scene/model_parameters.hpp"

namespace merkel {

/// Where an afferent of a patch is.
struct AfferentSite {
  double x_mm = 0.0;  ///< of the middle of its receptive field or subregion
  double y_mm = 0.0;
  double radius_mm = 0.0;     ///< of its receptive field; of the circle about its subregion
  std::size_t receptors = 0;  ///< how many it collects from
};

/// The receptors and afferents of a patch. Afferent n, from 1 within the patch, is afferents[n−1].
struct PatchLayout {
  std::vector<Receptor> receptors;
  std::vector<AfferentSite> afferents;
};

/// Which receptors and afferents a patch has: what a model of it simulates and every program shows.
/// The same parameters give the same bits on every machine. Real-time: no.
[[nodiscard]] Expected<PatchLayout, ParameterError> layout_of(const PatchParameters& parameters);

}  // namespace merkel
