#include "core/contact/taxel_array.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace merkel {
namespace {

constexpr double kTouching_mm = 1e-9;  ///< taxels that share an edge do not overlap

bool overlap(const TaxelArray& array, const Position& a, const Position& b) {
  const double x = std::fabs(a.x_mm - b.x_mm);
  const double y = std::fabs(a.y_mm - b.y_mm);
  if (array.shape == TaxelArray::Shape::kDisc) {
    return std::hypot(x, y) < array.width_mm - kTouching_mm;
  }
  return x < array.width_mm - kTouching_mm && y < array.length_mm - kTouching_mm;
}

bool any_overlap(const TaxelArray& array) {
  const std::vector<Position> centres = array.centres();
  for (std::size_t i = 0; i < centres.size(); ++i) {
    for (std::size_t j = i + 1; j < centres.size(); ++j) {
      if (overlap(array, centres[i], centres[j])) return true;
    }
  }
  return false;
}

std::size_t different_x(const TaxelArray& array) {
  std::vector<double> x;
  for (const Position& centre : array.centres()) x.push_back(centre.x_mm);
  std::sort(x.begin(), x.end());
  return static_cast<std::size_t>(std::unique(x.begin(), x.end()) - x.begin());
}

}  // namespace

std::size_t TaxelArray::size() const noexcept {
  return listed.empty() ? static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows)
                        : listed.size();
}

std::vector<Position> TaxelArray::centres() const {
  if (!listed.empty()) return listed;
  std::vector<Position> all;
  all.reserve(size());
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      all.push_back({.x_mm = pitch_mm * (column - 0.5 * (columns - 1)),
                     .y_mm = pitch_mm * (row - 0.5 * (rows - 1))});
    }
  }
  return all;
}

double TaxelArray::area_mm2() const noexcept {
  return shape == Shape::kDisc ? 0.25 * std::numbers::pi * width_mm * width_mm
                               : width_mm * length_mm;
}

FieldTable TaxelArray::fields() {
  using A = TaxelArray;
  static constexpr std::string_view kShapes[] = {"rectangle", "disc"};
  static constexpr Field kFields[] = {
      {"taxel_columns", "", not_negative(1024),
       "of the tip \"taxels\", a tactile array: taxels along x; their channels come in this order, "
       "then along y",
       at<&A::columns>},
      {"taxel_rows", "", not_negative(1024), "taxels along y", at<&A::rows>},
      {"taxel_pitch_mm", "mm", positive(100.0),
       "distance between the centres of neighbouring taxels", at<&A::pitch_mm>},
      {"taxel_centres_mm", "mm", from_to(-200.0, 200.0),
       "[[x, y], …]: centres of taxels that form no square lattice, from the array's middle, in the "
       "order of their channels; replaces columns, rows and pitch",
       at<&A::listed>},
      {"taxel_shape", "", one_of(kShapes), "shape of a taxel", at<&A::shape>},
      {"taxel_width_mm", "mm", positive(100.0), "width of a taxel along x; diameter of a disc",
       at<&A::width_mm>},
      {"taxel_length_mm", "mm", positive(100.0), "length of a rectangular taxel along y",
       at<&A::length_mm>},
      {"taxel_least_kPa", "kPa", not_negative(1e6),
       "smaller pressures on a taxel are taken as 0: above the noise of the array",
       at<&A::least_kPa>}};
  return {"probe", kFields};
}

void TaxelArray::check(const SkinParameters& /*skin*/, ParameterCheck& all) const {
  all.fields(*this)
      .require(size() >= 1, "probe.taxel_columns",
               "is missing: set the number of taxels along x and y (taxel_columns, taxel_rows), or "
               "their centres (taxel_centres_mm)")
      .require(size() <= kMax, "probe.taxel_columns", "gives more than 1024 taxels");
  if (!all.result()) return;
  all.require(!any_overlap(*this), "probe.taxel_width_mm",
              "makes taxels overlap: their distance must be at least their size")
      .require(different_x(*this) <= kMaxColumns, "probe.taxel_centres_mm",
               "has more than 64 different x: turn the array by orientation_deg, or list fewer");
}

}  // namespace merkel
