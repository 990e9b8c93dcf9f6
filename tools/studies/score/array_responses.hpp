#pragma once

#include <cstddef>
#include <vector>

#include "core/expected.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/scene/tactile_model.hpp"
#include "tools/studies/score/recordings.hpp"

namespace merkel {

/// For each depth, the area within which a pin of an array, pressed deeper for a second, evokes at
/// least one impulse more than the array: an ellipse, from its radii along and across the finger.
/// An array of one pin is a pin on bare skin.
struct FieldArea {
  double area_mm2 = 0.0;
  double response = 0.0;  ///< impulses in the middle of the field, above those of the array
};
[[nodiscard]] Expected<std::vector<FieldArea>, ParameterError> field_areas(
    const TactileModel::Parameters& scene, const Recordings::FieldAreas& areas, std::size_t trials,
    std::size_t threads);

/// For each number of pins of an array that are pressed deeper, the impulses above those of the
/// array, divided by the same with the middle pin alone. NaN if that evokes none.
[[nodiscard]] Expected<std::vector<double>, ParameterError> surround_ratios(
    const TactileModel::Parameters& scene, const Recordings::Surround& surround, std::size_t trials,
    std::size_t threads);

}  // namespace merkel
