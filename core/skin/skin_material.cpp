#include "core/skin/skin_material.hpp"

#include <algorithm>

#include "core/math/portable_math.hpp"

namespace merkel {

FieldTable SkinLayer::fields() {
  using L = SkinLayer;
  static constexpr Field kFields[] = {
      {"thickness_mm", "mm", positive(1e3),
       "thickness; of no effect in the last layer if bone = false; must be set",
       at<&L::thickness_mm>},
      {"E_kPa", "kPa", positive(1e9), "Young's modulus; must be set", at<&L::youngs_modulus_kPa>},
      {"poisson_ratio", "", from_to(0.0, 0.5), "Poisson's ratio", at<&L::poisson_ratio>}};
  return {"skin.layer", kFields};
}

FieldTable SkinParameters::fields() {
  using P = SkinParameters;
  static constexpr std::string_view kContactLaws[] = {"hertz", "sneddon"};
  static constexpr std::string_view kEnergyDensities[] = {"distortional", "full"};
  static constexpr Field kFields[] = {
      {"epidermis_kPa", "kPa", positive(1e6), "Young's modulus of the epidermis",
       at<&P::epidermis_kPa>},
      {"dermis_kPa", "kPa", positive(1e6), "Young's modulus of the dermis", at<&P::dermis_kPa>},
      {"poisson_ratio", "", from_below(0.0, 0.5), "Poisson's ratio of both layers",
       at<&P::poisson_ratio>},
      {"radius_mm", "mm", positive_or_infinite(1e6),
       "radius of curvature of the finger; inf: flat skin", at<&P::radius_mm>},
      {"radius_along_mm", "mm", not_negative(1e6),
       "radius of curvature along the finger (radius_mm is across it); 0: same as radius_mm",
       at<&P::radius_along_mm>},
      {"stiffening_mm", "mm", positive_or_infinite(1e6),
       "d1: all moduli grow by e^(depth/d1); inf: no stiffening", at<&P::stiffening_mm>},
      {"stiffening_kPa", "kPa", positive_or_infinite(1e6),
       "p1: all moduli grow by 1 + p/p1, p the mean pressure of the contact; inf: no stiffening",
       at<&P::stiffening_kPa>},
      {"apex_mm", "mm", from_to(-1e4, 1e4),
       "[x, y] of the highest point of a curved finger; a sphere offset from it touches closer to "
       "it",
       at<&P::apex>, "the skin curves away from the axis of the probe"},
      {"receptor_depth_mm", "mm", not_negative(100.0), "depth of the receptors below the surface",
       at<&P::receptor_depth_mm>},
      {"thickness_mm", "mm", positive_or_infinite(1e3),
       "thickness of the skin down to the bone; inf: no bone", at<&P::thickness_mm>},
      {"contact_law", "", one_of(kContactLaws),
       "shape of a sphere: a paraboloid (the paper, Hertz) or the exact sphere",
       at<&P::contact_law>},
      {"energy_density", "", one_of(kEnergyDensities),
       "strain energy density at the receptors: distortional part (the paper) or full",
       at<&P::energy_density>},
      {"bone", "", any_value(),
       "with [[skin.layer]]: the last layer lies on bone; false: it has no end", at<&P::bone>}};
  return {"skin", kFields};
}

Expected<void, ParameterError> SkinParameters::check() const {
  ParameterCheck all;
  for (const SkinLayer& layer : layers.all()) all.fields(layer);
  return all.fields(*this)
      .require(layers.empty() || receptor_depth_mm < bone_depth_mm(), "skin.receptor_depth_mm",
               "must be less than the thickness of all layers: the receptors lie in the skin, not "
               "the bone")
      .require(layers.empty() || !layered(), "skin.thickness_mm",
               "cannot be combined with [[skin.layer]]: remove it and set bone = true; the layers "
               "end on the bone")
      .require(std::isinf(stiffening_mm) || std::isinf(stiffening_kPa), "skin.stiffening_kPa",
               "cannot be combined with skin.stiffening_mm: remove one of them")
      .require(!apex || std::isfinite(radius_mm), "skin.apex_mm",
               "requires a curved finger: set skin.radius_mm")
      .require(receptor_depth_mm < thickness_mm, "skin.receptor_depth_mm",
               "must be less than skin.thickness_mm: the receptors lie in the skin, not the bone")
      .result();
}

double SkinParameters::stiffening_at(double depth_mm, double pressure_kPa) const noexcept {
  if (std::isinf(stiffening_kPa)) return stiffening_under(depth_mm, 0.0);
  return 1.0 / std::max(1.0 / kMaxStiffening, 1.0 - pressure_kPa / stiffening_kPa);
}

double SkinParameters::stiffening_under(double depth_mm, double pressure_kPa) const noexcept {
  if (std::isfinite(stiffening_kPa)) {
    return std::min(kMaxStiffening, 1.0 + pressure_kPa / stiffening_kPa);
  }
  return std::isfinite(stiffening_mm) ? portable_exp(std::max(0.0, depth_mm) / stiffening_mm) : 1.0;
}

double SkinParameters::bone_depth_mm() const noexcept {
  if (layers.empty()) return thickness_mm;
  if (!bone) return std::numeric_limits<double>::infinity();
  double depth_mm = 0.0;
  for (const SkinLayer& layer : layers.all()) depth_mm += layer.thickness_mm;
  return depth_mm;
}

SkinMaterial::SkinMaterial(const SkinParameters& parameters) noexcept
    : SkinMaterial(2.0 / (1.0 / parameters.epidermis_kPa + 1.0 / parameters.dermis_kPa),
                   parameters.poisson_ratio) {
  double below_mm = parameters.receptor_depth_mm;
  for (const SkinLayer& layer : parameters.layers.all()) {
    youngs_modulus_kPa_ = layer.youngs_modulus_kPa;
    poisson_ratio_ = layer.poisson_ratio;
    if (below_mm < layer.thickness_mm) break;
    below_mm -= layer.thickness_mm;
  }
}

SkinMaterial::SkinMaterial(double youngs_modulus_kPa, double poisson_ratio) noexcept
    : youngs_modulus_kPa_(youngs_modulus_kPa), poisson_ratio_(poisson_ratio) {}

double SkinMaterial::reduced_modulus_kPa() const noexcept {
  return youngs_modulus_kPa_ / (1.0 - poisson_ratio_ * poisson_ratio_);
}

double SkinMaterial::reduced_modulus_kPa(const SkinMaterial& indenter) const noexcept {
  return 1.0 / (1.0 / reduced_modulus_kPa() + 1.0 / indenter.reduced_modulus_kPa());
}

double SkinMaterial::shear_modulus_kPa() const noexcept {
  return youngs_modulus_kPa_ / (2.0 * (1.0 + poisson_ratio_));
}

double SkinMaterial::bulk_modulus_kPa() const noexcept {
  return youngs_modulus_kPa_ / (3.0 * (1.0 - 2.0 * poisson_ratio_));
}

}  // namespace merkel
