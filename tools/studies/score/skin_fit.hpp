#pragma once

#include <limits>
#include <string>
#include <vector>

#include "core/contact/indenter.hpp"
#include "core/expected.hpp"
#include "core/skin/skin_material.hpp"

namespace merkel {

/// A sample of a force-depth recording.
struct ForceAtDepth {
  double depth_mm = 0.0;
  double force_mN = 0.0;
};

/// The stiffness of skin, fitted to a press, with its uncertainty.
struct SkinFit {
  /// Of a force: the load cell's gain, the tip's shape, where the depth is 0.
  static constexpr double kRelativeError = 0.03;

  double modulus_kPa = 0.0;    ///< E0 of E*(d) = E0·e^(d/d1)
  double modulus_error = 0.0;  ///< relative standard error
  /// d1; infinite if the recording shows no stiffening.
  double stiffening_mm = std::numeric_limits<double>::infinity();
  double stiffening_error = 0.0;  ///< relative standard error of 1/d1
  double correlation = 0.0;       ///< between the two errors
  double rms_mN = 0.0;            ///< of the residuals
  double rms_weighted = 0.0;  ///< of the residuals as they are weighed: relative at large forces
  double largest_mN = 0.0;    ///< of the residuals
  double r2 = 0.0;            ///< 1 − SSE/SST
  double hysteresis = 0.0;    ///< work lost from loading to unloading over the work of loading
  bool unloaded = false;      ///< the recording has an unloading half
  std::size_t samples = 0;    ///< of the loading half, with contact
  double deepest_mm = 0.0;
  std::vector<ForceAtDepth> loading;
  std::vector<double> predicted_mN;  ///< of each sample
};

/// Fits E0 and d1 to the loading half of a press, up to the deepest sample, by least squares
/// (Gauss-Newton) of asinh(F/F0): of relative errors above F0, of absolute ones below. The errors
/// of a load cell's gain, of the tip and of the depth's zero grow with the force; its noise does
/// not. F0 is the scatter of the force out of contact over SkinFit::kRelativeError, at least a
/// thousandth of the largest force. Least squares of the force itself would fit the deepest
/// millimetre alone. The standard errors count neighbouring samples that err alike as fewer. The
/// shape of the contact, F/E* as a function of the depth, is that of the tip on skin of the scene's
/// curvature, layer and law. Fails with a recording of fewer than four samples in contact, or where
/// the force does not grow with the depth.
[[nodiscard]] Expected<SkinFit, SetupError> fit_skin(const std::vector<ForceAtDepth>& press,
                                                     const Indenter& tip,
                                                     const SkinParameters& skin);

/// Reads depth and force from a trace. Fails if one of them is missing.
[[nodiscard]] Expected<std::vector<ForceAtDepth>, SetupError> read_force_depth(
    const std::string& path);

}  // namespace merkel
