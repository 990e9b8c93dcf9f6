#include "core/receptors/patch.hpp"

#include <algorithm>
#include <cassert>

namespace merkel {

FieldTable Patch::fields() {
  static constexpr Field kFields[] = {
      {"length_mm", "mm", positive(1e3), "length of the patch along the finger (x)",
       at<&Patch::length_mm>},
      {"width_mm", "mm", positive(1e3), "width of the patch (y)", at<&Patch::width_mm>},
      {"columns", "", from_to(1, 1000), "subregions along x, one afferent each",
       at<&Patch::columns>},
      {"rows", "", from_to(1, 1000), "subregions along y", at<&Patch::rows>}};
  return {"receptors", kFields};
}

Expected<void, ParameterError> Patch::check() const {
  return ParameterCheck().fields(*this).result();
}

bool Patch::contains(double x_mm, double y_mm) const noexcept {
  return x_mm >= 0.0 && x_mm <= length_mm && y_mm >= 0.0 && y_mm <= width_mm;
}

std::uint32_t Patch::neuron_at(double x_mm, double y_mm) const noexcept {
  assert(contains(x_mm, y_mm));
  const auto cell = [](double place, int cells) {
    return place > 0.0 ? static_cast<int>(std::min(place, cells - 1.0)) : 0;
  };
  const int column = cell(x_mm * columns / length_mm, columns);
  const int row = cell(y_mm * rows / width_mm, rows);
  return static_cast<std::uint32_t>(row * columns + column + 1);
}

double Patch::centre_x_mm(std::uint32_t neuron) const noexcept {
  const int column = static_cast<int>(neuron - 1) % columns;
  return (column + 0.5) * length_mm / columns;
}

double Patch::centre_y_mm(std::uint32_t neuron) const noexcept {
  const int row = static_cast<int>(neuron - 1) / columns;
  return (row + 0.5) * width_mm / rows;
}

}  // namespace merkel
