#include "core/skin/skin_material.hpp"

namespace merkel {

Expected<void, ParameterError> SkinParameters::check() const {
  return ParameterCheck()
      .positive("skin.epidermis_kPa", epidermis_kPa)
      .positive("skin.dermis_kPa", dermis_kPa)
      .in_range("skin.poisson_ratio", poisson_ratio, 0.0, 0.5)
      .positive_or_infinite("skin.radius_mm", radius_mm)
      .not_negative("skin.receptor_depth_mm", receptor_depth_mm)
      .positive_or_infinite("skin.thickness_mm", thickness_mm)
      .require(!apex || std::isfinite(radius_mm), "skin.apex_mm",
               "is only of a curved finger: set skin.radius_mm")
      .require(!apex || (std::isfinite(apex->x_mm) && std::isfinite(apex->y_mm)), "skin.apex_mm",
               "must be two finite numbers")
      .require(receptor_depth_mm < thickness_mm, "skin.receptor_depth_mm",
               "must be less than skin.thickness_mm: the receptors lie in the skin, not the bone")
      .require(contact_law == ContactLaw::kHertz || !layered(), "skin.contact_law",
               "must be \"hertz\" where skin.thickness_mm is set: the layer corrects that law")
      .result();
}

SkinMaterial::SkinMaterial(const SkinParameters& parameters) noexcept
    : SkinMaterial(2.0 / (1.0 / parameters.epidermis_kPa + 1.0 / parameters.dermis_kPa),
                   parameters.poisson_ratio) {}

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
