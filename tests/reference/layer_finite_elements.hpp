#pragma once

#include <vector>

#include "core/skin/skin_material.hpp"
#include "core/skin/stress.hpp"

namespace merkel::reference {

/// A paraboloid pressed without friction into a layer bonded to a rigid base, by axisymmetric
/// finite elements: four-node elements with mean dilatation (B-bar) and an active set of surface
/// nodes. Independent of the formulas of core/contact. Second order in the element size.
class LayerFiniteElements {
 public:
  struct Parameters {
    double youngs_modulus_kPa = 100.0;
    double poisson_ratio = 0.48;
    double thickness_mm = 4.0;
    double upper_mm = 0.0;   ///< thickness of a layer of its own, outermost; 0: one layer
    double upper_kPa = 0.0;  ///< Young's modulus of that layer
    double radius_mm = 2.0;  ///< of the paraboloid
    double depth_mm = 1.0;
    double element_mm = 0.05;  ///< near the contact; elements grow away from it
  };
  /// Solves the contact; takes seconds.
  explicit LayerFiniteElements(const Parameters& parameters);

  [[nodiscard]] double force_mN() const noexcept { return force_mN_; }
  [[nodiscard]] double contact_radius_mm() const noexcept { return contact_radius_mm_; }
  /// By bilinear interpolation between the centres of the elements.
  [[nodiscard]] AxisymmetricStress stress(double r_mm, double z_mm) const;

 private:
  [[nodiscard]] std::size_t node(std::size_t column, std::size_t row) const {
    return row * r_.size() + column;
  }
  void fill_centres(const std::vector<double>& u, const Parameters& parameters);

  std::vector<double> r_, z_;  ///< of the nodes' columns and rows
  std::vector<AxisymmetricStress> centres_;
  double force_mN_ = 0.0;
  double contact_radius_mm_ = 0.0;
};

}  // namespace merkel::reference
