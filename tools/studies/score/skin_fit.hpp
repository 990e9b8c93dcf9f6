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
  /// Relative error of a force, from the load cell's gain, the tip's shape and the zero of depth.
  static constexpr double kRelativeError = 0.03;

  bool by_pressure = false;    ///< E* = E0(1 + p/p1), else E* = E0·e^(d/d1)
  double modulus_kPa = 0.0;    ///< E0
  double modulus_error = 0.0;  ///< relative standard error
  bool stiffens = false;       ///< the recording shows stiffening
  /// d1 in mm, or p1 in kPa; infinite without stiffening.
  double stiffening = std::numeric_limits<double>::infinity();
  double stiffening_error = 0.0;  ///< relative standard error of 1/d1 or 1/p1
  double correlation = 0.0;       ///< between the two errors
  double rms_mN = 0.0;            ///< of the residuals
  double rms_weighted = 0.0;      ///< of the weighted residuals: relative for large forces
  double largest_mN = 0.0;        ///< of the residuals
  double r2 = 0.0;                ///< 1 − SSE/SST
  double hysteresis = 0.0;        ///< lost work over the work of loading
  bool unloaded = false;          ///< the recording has an unloading phase
  std::size_t samples = 0;        ///< of the loading phase, in contact
  double deepest_mm = 0.0;
  std::vector<ForceAtDepth> loading;
  std::vector<double> predicted_mN;  ///< of each sample
};

/// Fits E0 and d1, or E0 and p1 if the scene's skin stiffens with the pressure, to the loading
/// phase of a press, up to the deepest sample, by least squares (Gauss-Newton) of asinh(F/F0):
/// relative errors above F0, absolute errors below. Errors of the load cell's gain, of the tip and
/// of the zero of depth grow with the force; the noise does not. F0 is the scatter of the force
/// without contact over SkinFit::kRelativeError, at least a thousandth of the largest force. Least
/// squares of the force itself would fit only the deepest millimetre. The standard errors take the
/// correlation of neighbouring samples into account. F/E* as a function of depth, and the area, are
/// those of the tip on skin with the scene's curvature, layer and law. Fails for fewer than four
/// samples in contact, or if the force does not increase with the depth.
[[nodiscard]] Expected<SkinFit, SetupError> fit_skin(const std::vector<ForceAtDepth>& press,
                                                     const Indenter& tip,
                                                     const SkinParameters& skin);

/// Reads depth and force from a trace. Fails if one of them is missing.
/// \param invert_force  compression is negative in the trace
[[nodiscard]] Expected<std::vector<ForceAtDepth>, SetupError> read_force_depth(
    const std::string& path, bool invert_force);

}  // namespace merkel
