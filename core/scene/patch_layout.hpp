#pragma once

#include <cstddef>
#include <vector>

#include "core/parameters/parameter_error.hpp"
#include "core/receptors/receptor_placement.hpp"
#include "core/scene/model_parameters.hpp"

namespace merkel {

/// The position of an afferent on its patch.
struct AfferentSite {
  double x_mm = 0.0;  ///< centre of its receptive field or subregion
  double y_mm = 0.0;
  double radius_mm = 0.0;     ///< of its receptive field, or of the circle around its subregion
  std::size_t receptors = 0;  ///< number of its receptors
};

/// The receptors and afferents of a patch. Afferent n, from 1 within the patch, is afferents[n−1].
struct PatchLayout {
  std::vector<Receptor> receptors;
  std::vector<AfferentSite> afferents;
};

/// How large a layout will be, before it is made.
struct PatchSize {
  double receptors = 0.0;
  double afferents = 0.0;
  const char* key = "";  ///< of the parameter that gives the number
};

/// Fails if a parameter of the placement is out of its range.
[[nodiscard]] Expected<PatchSize, ParameterError> size_of(const PatchParameters& parameters);

/// The receptors and afferents that a model of a patch simulates and every program shows.
/// The same parameters give the same bits on every machine. Real-time: no.
[[nodiscard]] Expected<PatchLayout, ParameterError> layout_of(const PatchParameters& parameters);

}  // namespace merkel
