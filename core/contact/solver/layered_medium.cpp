#include "core/contact/solver/layered_medium.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <Eigen/Dense>
#include <math.h>  // j0, j1 of POSIX

#include "core/math/cubic_interpolation.hpp"
#include "core/math/gauss_legendre.hpp"

namespace merkel {
namespace {

using std::numbers::pi;

constexpr double kNeglectedDecades = 30.0;  ///< e^{−30} = 1e-13
constexpr double kRadialStep = 0.06;
constexpr int kRadialPanel = 16;  ///< Gauss-Legendre nodes per panel
constexpr Eigen::Index kSolutions = 4;

/// 2Gξ·U, 2Gξ·W, 2G·U', 2G·W' and 2G·(ξU + W')/(1−2ν) of the four solutions, at a·1/ξ below the
/// upper face and b·1/ξ above the lower one.
using Solutions = Eigen::Matrix<double, 5, kSolutions>;

Solutions solutions_at(double a, double b, double nu) {
  const double kappa = 3.0 - 4.0 * nu;
  const double down = std::exp(-a);
  const double up = std::isinf(b) ? 0.0 : std::exp(-b);
  const double rest = std::isinf(b) ? 0.0 : b;
  Solutions s;
  s.col(0) << down, down, -down, -down, 0.0;
  s.col(1) << a * down, (kappa + a) * down, (1.0 - a) * down, (1.0 - kappa - a) * down, -2.0 * down;
  s.col(2) << up, -up, up, -up, 0.0;
  s.col(3) << rest * up, -(kappa + rest) * up, (rest - 1.0) * up, (1.0 - kappa - rest) * up,
      -2.0 * up;
  return s;
}

Eigen::Matrix<double, 1, kSolutions> sigma_z(const Solutions& s, double nu) {
  return s.row(3) + nu * s.row(4);
}
Eigen::Matrix<double, 1, kSolutions> shear(const Solutions& s) {
  return 0.5 * (s.row(2) - s.row(1));
}

double shear_modulus(const SkinLayer& layer) {
  return layer.youngs_modulus_kPa / (2.0 * (1.0 + layer.poisson_ratio));
}

std::vector<SkinLayer> layers_of(const SkinParameters& skin) {
  if (!skin.layers.empty()) {
    const auto all = skin.layers.all();
    std::vector<SkinLayer> layers(all.begin(), all.end());
    if (!skin.bone) layers.back().thickness_mm = std::numeric_limits<double>::infinity();
    return layers;
  }
  return {{.thickness_mm = skin.thickness_mm,
           .youngs_modulus_kPa = SkinMaterial(skin).youngs_modulus_kPa(),
           .poisson_ratio = skin.poisson_ratio}};
}

/// Wave numbers up to a limit, dense enough for a distance: sixteen nodes per two and a half
/// wavelengths.
std::vector<QuadratureNode> wave_numbers_to(double end, double farthest_mm) {
  const auto panels = static_cast<int>(std::ceil(end * farthest_mm / (5.0 * pi))) + 4;
  std::vector<QuadratureNode> nodes;
  for (int k = 0; k < panels; ++k) {
    const auto panel = gauss_legendre(kRadialPanel, end * k / panels, end * (k + 1) / panels);
    nodes.insert(nodes.end(), panel.begin(), panel.end());
  }
  return nodes;
}

/// The transform of an even load on a disc, 2·J1(x)/x.
double disc_factor(double x) { return x < 1e-4 ? 1.0 : 2.0 * ::j1(x) / x; }

}  // namespace

LayeredMedium::LayeredMedium(std::vector<SkinLayer> layers)
    : layers_(std::move(layers)), bone_(std::isfinite(layers_.back().thickness_mm)) {}

LayeredMedium::LayeredMedium(const SkinParameters& skin) : LayeredMedium(layers_of(skin)) {}

std::vector<double> LayeredMedium::factors(double wave_number_per_mm) const {
  const auto count = static_cast<Eigen::Index>(layers_.size());
  const Eigen::Index unknowns = kSolutions * count;
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(unknowns, unknowns);
  Eigen::VectorXd loads = Eigen::VectorXd::Zero(unknowns);
  const double reference = shear_modulus(layers_.front());
  Eigen::Index row = 0;
  for (Eigen::Index i = 0; i < count; ++i) {
    const SkinLayer& layer = layers_[static_cast<std::size_t>(i)];
    const double thickness = wave_number_per_mm * layer.thickness_mm;
    const double nu = layer.poisson_ratio;
    const double softness = reference / shear_modulus(layer);
    const Solutions top = solutions_at(0.0, thickness, nu);
    const Eigen::Index column = kSolutions * i;
    if (i == 0) {
      matrix.block<1, kSolutions>(row, column) = sigma_z(top, nu);
      matrix.block<1, kSolutions>(row + 1, column) = shear(top);
      loads(row) = -1.0;
      row += 2;
    } else {
      // The face above: its rows hold the upper layer's values already.
      matrix.block<2, kSolutions>(row - 4, column) = -softness * top.topRows<2>();
      matrix.block<1, kSolutions>(row - 2, column) = -sigma_z(top, nu);
      matrix.block<1, kSolutions>(row - 1, column) = -shear(top);
    }
    if (std::isinf(layer.thickness_mm)) {
      // Nothing comes back from infinity.
      matrix(row, column + 2) = 1.0;
      matrix(row + 1, column + 3) = 1.0;
      break;
    }
    const Solutions base = solutions_at(thickness, 0.0, nu);
    matrix.block<2, kSolutions>(row, column) = softness * base.topRows<2>();
    if (i + 1 == count) break;  // bonded to bone
    matrix.block<1, kSolutions>(row + 2, column) = sigma_z(base, nu);
    matrix.block<1, kSolutions>(row + 3, column) = shear(base);
    row += 4;
  }
  const Eigen::VectorXd solved = matrix.fullPivLu().solve(loads);
  return {solved.data(), solved.data() + solved.size()};
}

LayeredMedium::Response LayeredMedium::response(double wave_number_per_mm, double z_mm) const {
  const std::vector<double> factor = factors(wave_number_per_mm);
  std::size_t index = 0;
  double below = z_mm;
  while (index + 1 < layers_.size() && below >= layers_[index].thickness_mm) {
    below -= layers_[index++].thickness_mm;
  }
  const SkinLayer& layer = layers_[index];
  const Solutions s =
      solutions_at(wave_number_per_mm * below, wave_number_per_mm * (layer.thickness_mm - below),
                   layer.poisson_ratio);
  const Eigen::Map<const Eigen::Vector4d> own(factor.data() + 4 * index);
  const Eigen::Matrix<double, 5, 1> at = s * own;
  return {.radial = at(0),
          .gradient = at(3),
          .dilatation = at(4),
          .shear = 0.5 * (at(2) - at(1)),
          .poisson_ratio = layer.poisson_ratio};
}

double LayeredMedium::excess_compliance(double wave_number_per_mm) const {
  if (half_space()) return 0.0;
  const std::vector<double> factor = factors(wave_number_per_mm);
  const SkinLayer& first = layers_.front();
  const Solutions s =
      solutions_at(0.0, wave_number_per_mm * first.thickness_mm, first.poisson_ratio);
  const double w = s.row(1).dot(Eigen::Map<const Eigen::Vector4d>(factor.data()));
  return w / (2.0 * (1.0 - first.poisson_ratio)) - 1.0;
}

PointResponse::PointResponse(const LayeredMedium& medium, double z_mm, double disc_mm,
                             double farthest_mm)
    : scale_mm_(0.25 * z_mm) {
  assert(z_mm > 0.0);
  const double thinnest = medium.layers().front().thickness_mm;
  if (!medium.half_space()) scale_mm_ = std::min(scale_mm_, 0.5 * thinnest);
  points_ = static_cast<std::size_t>(std::asinh(farthest_mm / scale_mm_) / kRadialStep) + 4;
  values_.assign(kFields * points_, 0.0);
  const auto radius = [this](std::size_t k) {
    return scale_mm_ * std::sinh(kRadialStep * static_cast<double>(k));
  };
  const auto value = [this](Field field, std::size_t k) -> double& {
    return values_[static_cast<std::size_t>(field) * points_ + k];
  };
  for (const auto& [xi, weight] : wave_numbers_to(kNeglectedDecades / z_mm, farthest_mm)) {
    const LayeredMedium::Response at = medium.response(xi, z_mm);
    const double amount = weight * xi * disc_factor(xi * disc_mm) / (2.0 * pi);
    const double mean = at.poisson_ratio * at.dilatation;
    for (std::size_t k = 0; k < points_; ++k) {
      const double x = xi * radius(k);
      const double even = ::j0(x);
      const double odd = ::j1(x);
      const double ratio = x < 1e-8 ? 0.5 : odd / x;
      value(kSigmaR, k) += amount * ((at.radial + mean) * even - at.radial * ratio);
      value(kSigmaTheta, k) += amount * (mean * even + at.radial * ratio);
      value(kSigmaZ, k) += amount * (at.gradient + mean) * even;
      value(kTauRz, k) += amount * at.shear * odd;
    }
  }
  if (medium.half_space()) return;
  // The excess decays as e^{−2ξh} of the first layer.
  const double unit = 1.0 / (pi * medium.reduced_modulus_kPa());
  for (const auto& [xi, weight] :
       wave_numbers_to(0.5 * (kNeglectedDecades + 6.0) / thinnest, farthest_mm)) {
    const double amount = unit * weight * disc_factor(xi * disc_mm) * medium.excess_compliance(xi);
    for (std::size_t k = 0; k < points_; ++k) value(kExcess, k) += amount * ::j0(xi * radius(k));
  }
}

double PointResponse::place_of(double r_mm) const noexcept {
  return std::min(std::asinh(r_mm / scale_mm_) / kRadialStep, static_cast<double>(points_) - 3.0);
}

double PointResponse::at(Field field, double place) const noexcept {
  const auto first = static_cast<std::size_t>(place);
  const auto weights = cubic_weights(place - static_cast<double>(first));
  const double* const values = values_.data() + static_cast<std::size_t>(field) * points_;
  // All but the shear are even in r.
  const double mirrored = field == kTauRz ? -values[1] : values[1];
  return weights[0] * (first == 0 ? mirrored : values[first - 1]) + weights[1] * values[first] +
         weights[2] * values[first + 1] + weights[3] * values[first + 2];
}

AxisymmetricStress PointResponse::stress(double r_mm) const noexcept {
  const double place = place_of(r_mm);
  return {.sigma_r = at(kSigmaR, place),
          .sigma_theta = at(kSigmaTheta, place),
          .sigma_z = at(kSigmaZ, place),
          .tau_rz = at(kTauRz, place)};
}

double PointResponse::excess_displacement_mm(double r_mm) const noexcept {
  return at(kExcess, place_of(r_mm));
}

}  // namespace merkel
