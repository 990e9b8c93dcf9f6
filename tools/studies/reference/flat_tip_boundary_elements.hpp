#pragma once

#include <limits>
#include <vector>

#include "core/skin/stress.hpp"

namespace merkel::reference {

/// A straight rigid bar or a round pin pressed without friction into a curved finger, by boundary
/// elements: uniform pressures on rectangles (Love 1929; Johnson, Contact Mechanics, Eq.
/// 3.25), with an active-set contact. Independent of the formulas of core/contact.
class FlatTipBoundaryElements {
 public:
  struct Parameters {
    double reduced_modulus_kPa = 130.0;
    double poisson_ratio = 0.48;
    double width_mm = 3.0;        ///< along x; of a pin, the diameter
    double length_mm = 20.0;      ///< along y; of a pin, the diameter
    bool round = false;           ///< a pin: only the elements inside the circle
    double skin_radius_mm = 7.0;  ///< across the finger, along y
    double skin_radius_along_mm = std::numeric_limits<double>::infinity();  ///< along x
    double depth_mm = 1.0;
    int columns = 24;  ///< of elements across the bar, refined at its edges
    int rows = 60;     ///< along its contact
  };
  explicit FlatTipBoundaryElements(const Parameters& parameters);

  [[nodiscard]] double force_mN() const noexcept { return force_mN_; }
  /// Superposes point loads; z must be at least about one element.
  [[nodiscard]] CartesianStress stress(double x_mm, double y_mm, double z_mm) const;

 private:
  struct Element {
    double x, y, half_width, half_length, pressure_kPa;
  };
  std::vector<Element> elements_;  ///< of the quarter x > 0, y > 0
  double poisson_ratio_;
  double force_mN_ = 0.0;
};

}  // namespace merkel::reference
