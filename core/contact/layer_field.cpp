#include "core/contact/layer_field.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include <Eigen/Dense>
#include <math.h>  // j0, j1 of POSIX

#include "core/contact/bonded_layer.hpp"
#include "core/math/cubic_interpolation.hpp"
#include "core/math/gauss_legendre.hpp"

namespace merkel {
namespace {

using std::numbers::pi;

constexpr double kDecades = 30.0;              ///< e^{−30} = 1e-13 is neglected
constexpr double kFarthest_thicknesses = 8.0;  ///< beyond the rim; the field is negligible there
constexpr std::size_t kMostRows = 240;
constexpr int kPanel = 16;  ///< Gauss-Legendre nodes per panel

/// The response to a unit pressure p(ξ) at a depth z, in units of p and p/2G.
struct LayerResponse {
  double radial;      ///< 2G·U
  double gradient;    ///< 2G·W'
  double dilatation;  ///< 2G·(ξU + W')/(1−2ν)
  double shear;       ///< τ
};

/// Solves the layer for one wave number. The solutions of (1−2ν)∇²u + ∇∇·u = 0 that decay from the
/// surface are (U, W) = (1, 1)e^{−ξz} and (ξz, κ+ξz)e^{−ξz}, κ = 3−4ν. The solutions that decay
/// from the base are their mirror images in ζ = h−z.
LayerResponse response(double xi, double z, double h, double nu) {
  const double kappa = 3.0 - 4.0 * nu;
  /// U, W, U', W' and (ξU + W')/(1−2ν) of the four solutions at a depth.
  const auto solutions = [&](double depth) {
    Eigen::Matrix<double, 5, 4> s;
    const double zeta = h - depth;
    const double down = std::exp(-xi * depth);
    const double up = std::exp(-xi * zeta);
    const double a = xi * depth;
    const double b = xi * zeta;
    s.col(0) << down, down, -xi * down, -xi * down, 0.0;
    s.col(1) << a * down, (kappa + a) * down, xi * (1.0 - a) * down, xi * (1.0 - kappa - a) * down,
        -2.0 * xi * down;
    s.col(2) << up, -up, xi * up, -xi * up, 0.0;
    s.col(3) << b * up, -(kappa + b) * up, xi * (b - 1.0) * up, xi * (1.0 - kappa - b) * up,
        -2.0 * xi * up;
    return s;
  };
  const auto top = solutions(0.0);
  const auto base = solutions(h);
  Eigen::Matrix4d conditions;
  conditions.row(0) = top.row(3) + nu * top.row(4);          // σz = 2G(W' + νe)
  conditions.row(1) = 0.5 * (top.row(2) - xi * top.row(1));  // τ = G(U' − ξW)
  conditions.row(2) = base.row(0);
  conditions.row(3) = base.row(1);
  const Eigen::Vector4d loads(-1.0, 0.0, 0.0, 0.0);
  const Eigen::Vector4d constants = conditions.fullPivLu().solve(loads);
  const Eigen::Matrix<double, 5, 1> at = solutions(z) * constants;
  return {
      .radial = at(0), .gradient = at(3), .dilatation = at(4), .shear = 0.5 * (at(2) - xi * at(1))};
}

/// Wave numbers up to the limit set by the receptors' depth, dense enough for the distances.
std::vector<QuadratureNode> wave_numbers(double depth_mm, double farthest_mm) {
  const double end = kDecades / depth_mm;
  // Sixteen nodes per two and a half wavelengths.
  const auto panels = static_cast<int>(std::ceil(end * farthest_mm / (5.0 * pi))) + 4;
  std::vector<QuadratureNode> nodes;
  for (int k = 0; k < panels; ++k) {
    const auto panel = gauss_legendre(kPanel, end * k / panels, end * (k + 1) / panels);
    nodes.insert(nodes.end(), panel.begin(), panel.end());
  }
  return nodes;
}

/// ∫ φ(t)·cos(ξt) dt divided by ∫ φ(t) dt, times 1/2π: the pressure per force.
double pressure_of(const LayerContact& contact, double h, double xi) {
  double sum = 0.0;
  double force = 0.0;
  for (std::size_t j = 0; j < contact.nodes.size(); ++j) {
    const double weighted = contact.nodes[j].weight * contact.phi[j];
    sum += weighted * std::cos(xi * h * contact.nodes[j].x);
    force += weighted;
  }
  return sum / force / (2.0 * pi);
}

/// φ of a contact as a polynomial in (t/a)².
Eigen::VectorXd series_of(const LayerContact& contact) {
  constexpr Eigen::Index kTerms = 8;
  const auto count = static_cast<Eigen::Index>(contact.nodes.size());
  Eigen::MatrixXd powers(count, kTerms);
  Eigen::VectorXd phi(count);
  for (Eigen::Index j = 0; j < count; ++j) {
    const QuadratureNode& node = contact.nodes[static_cast<std::size_t>(j)];
    const double s = node.x * node.x / (contact.radius * contact.radius);
    phi(j) = contact.phi[static_cast<std::size_t>(j)];
    powers(j, 0) = 1.0;
    for (Eigen::Index k = 1; k < kTerms; ++k) powers(j, k) = s * powers(j, k - 1);
  }
  return powers.colPivHouseholderQr().solve(phi);
}

/// Surface displacement at the distance r per force, times E*, of a half-space under the contact's
/// pressure: u = (2/π)·∫φ/√(r²−t²) dt for t up to a or r; F = 2E*·∫φ dt.
class HalfSpaceDisplacement {
 public:
  HalfSpaceDisplacement(const LayerContact& contact, double h)
      : radius_mm_(contact.radius * h), force_(contact.force * h) {
    if (radius_mm_ > 0.0) series_ = series_of(contact);
  }
  double operator()(double r) const {
    if (!(radius_mm_ > 0.0)) return 1.0 / (pi * std::max(r, 1e-9));
    // t = r·sin θ removes the root from the integral.
    static const auto nodes = gauss_legendre(16, 0.0, 1.0);
    const double end = r > radius_mm_ ? std::asin(radius_mm_ / r) : 0.5 * pi;
    double sum = 0.0;
    for (const QuadratureNode& node : nodes) {
      const double t = r * std::sin(end * node.x) / radius_mm_;
      double phi = 0.0;
      for (Eigen::Index k = series_.size(); k-- > 0;) phi = phi * t * t + series_(k);
      sum += end * node.weight * phi;
    }
    return 2.0 / pi * sum / force_;
  }

 private:
  double radius_mm_;
  double force_;
  Eigen::VectorXd series_;
};

}  // namespace

LayerField::LayerField(const SkinParameters& skin, double largest_radius_mm)
    : spacing_mm_(std::clamp(0.1 * skin.receptor_depth_mm, 0.01, 0.1)) {
  assert(skin.layered() && skin.receptor_depth_mm >= kLeastDepth_mm);
  const double h = skin.thickness_mm;
  const double z = skin.receptor_depth_mm;
  const double largest =
      std::min(std::max(largest_radius_mm, 0.1 * z), BondedLayer::kLargestRadius * h);
  rows_ = std::clamp(static_cast<std::size_t>(std::ceil(6.0 * largest / z)), std::size_t{8},
                     kMostRows) +
          1;
  row_spacing_mm_ = largest / static_cast<double>(rows_ - 1);
  points_ = std::min(kMostPoints,
                     static_cast<std::size_t>((largest + kFarthest_thicknesses * h) / spacing_mm_));
  const double farthest = spacing_mm_ * static_cast<double>(points_ - 1);
  const auto xi = wave_numbers(z, farthest + largest);
  const auto count = static_cast<Eigen::Index>(xi.size());

  // [row][ξ]: pressure per force. [ξ][point]: the Bessel functions.
  const auto rows = static_cast<Eigen::Index>(rows_);
  const auto points = static_cast<Eigen::Index>(points_);
  const LayerEquation equation(skin.poisson_ratio);
  Eigen::MatrixXd pressure(rows, count);
  std::vector<HalfSpaceDisplacement> displacement;
  for (Eigen::Index row = 0; row < rows; ++row) {
    const LayerContact contact = equation.solve(row_spacing_mm_ * static_cast<double>(row) / h);
    for (Eigen::Index k = 0; k < count; ++k) {
      pressure(row, k) = pressure_of(contact, h, xi[static_cast<std::size_t>(k)].x);
    }
    displacement.emplace_back(contact, h);
  }
  Eigen::MatrixXd J0(count, points);
  Eigen::MatrixXd J1(count, points);
  Eigen::MatrixXd j1_over_r(count, points);
  for (Eigen::Index point = 0; point < points; ++point) {
    const double r = spacing_mm_ * static_cast<double>(point);
    for (Eigen::Index k = 0; k < count; ++k) {
      const double x = xi[static_cast<std::size_t>(k)].x;
      J0(k, point) = ::j0(x * r);
      J1(k, point) = ::j1(x * r);
      j1_over_r(k, point) = point == 0 ? 0.5 * x : J1(k, point) / r;
    }
  }

  // ε_r = ∫ξ²U·J0 − ∫ξU·J1/r, ε_θ = ∫ξU·J1/r, ε_z = ∫ξW'·J0; σ = 2G·(ε + ν·e/(1−2ν)).
  const double nu = skin.poisson_ratio;
  const double modulus = SkinMaterial(skin).reduced_modulus_kPa();
  Eigen::ArrayXd radial(count);
  Eigen::ArrayXd gradient(count);
  Eigen::ArrayXd dilatation(count);
  Eigen::ArrayXd shear(count);
  Eigen::ArrayXd bone(count);  // reduction of the half-space's displacement by the bone
  Eigen::ArrayXd wave(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto& [x, weight] = xi[static_cast<std::size_t>(k)];
    const LayerResponse at = response(x, z, h, nu);
    wave(k) = x;
    radial(k) = weight * x * at.radial;
    gradient(k) = weight * x * at.gradient;
    dilatation(k) = weight * x * at.dilatation;
    shear(k) = weight * x * at.shear;
    bone(k) = -2.0 / modulus * weight * LayerEquation::stiffening(x * h, nu);
  }
  const auto transform = [&](const Eigen::ArrayXd& kernel, const Eigen::MatrixXd& bessel) {
    return Eigen::MatrixXd(pressure * kernel.matrix().asDiagonal() * bessel);
  };
  const Eigen::MatrixXd hoop = transform(radial, j1_over_r);
  const Eigen::MatrixXd mean = nu * transform(dilatation, J0);
  table_.resize(kFields * rows_ * points_);
  const auto keep = [&](Field field, const Eigen::MatrixXd& values) {
    for (Eigen::Index row = 0; row < rows; ++row) {
      double* const to = table_.data() + (field * rows_ + static_cast<std::size_t>(row)) * points_;
      for (Eigen::Index point = 0; point < points; ++point) to[point] = values(row, point);
    }
  };
  keep(kSigmaR, transform(wave * radial, J0) - hoop + mean);
  keep(kSigmaTheta, hoop + mean);
  keep(kSigmaZ, transform(gradient, J0) + mean);
  keep(kTauRz, transform(shear, J1));
  Eigen::MatrixXd surface = transform(bone, J0);
  for (Eigen::Index row = 0; row < rows; ++row) {
    for (Eigen::Index point = 0; point < points; ++point) {
      surface(row, point) +=
          displacement[static_cast<std::size_t>(row)](spacing_mm_ * static_cast<double>(point)) /
          modulus;
    }
  }
  keep(kDisplacement, surface);
}

std::size_t LayerField::points_within(double distance_mm) const noexcept {
  const double wanted = std::min(distance_mm / spacing_mm_, static_cast<double>(points_)) + 4.0;
  return std::min(points_, static_cast<std::size_t>(wanted));
}

LayerField::Rows LayerField::rows_of(const ContactState& contact) const noexcept {
  const double last = static_cast<double>(rows_ - 1);
  const double place = std::min(contact.contact_radius_mm / row_spacing_mm_, last);
  // The field is even in the contact radius: row −1 is row 1. At the end, the last rows are used.
  const double below = std::min(std::floor(place), last - 2.0);
  const auto weights = cubic_weights(place - below);
  const auto first = static_cast<std::size_t>(below);
  Rows rows{};
  for (std::size_t i = 0; i < kRowWeights; ++i) {
    rows.row[i] = first + i == 0 ? 1 : first + i - 1;
    rows.weight[i] = weights[i] * contact.force_mN;
  }
  return rows;
}

void LayerField::profile(const ContactState& contact, Field field,
                         std::span<double> values_at) const noexcept {
  assert(values_at.size() <= points_);
  const Rows rows = rows_of(contact);
  const double* const a = values(field, rows.row[0]);
  const double* const b = values(field, rows.row[1]);
  const double* const c = values(field, rows.row[2]);
  const double* const d = values(field, rows.row[3]);
  for (std::size_t k = 0; k < values_at.size(); ++k) {
    values_at[k] = (rows.weight[0] * a[k] + rows.weight[1] * b[k]) +
                   (rows.weight[2] * c[k] + rows.weight[3] * d[k]);
  }
}

double LayerField::at(const Rows& rows, Field field, double r_mm) const noexcept {
  const double place = r_mm / spacing_mm_;
  if (!(place < static_cast<double>(points_ - 3))) return 0.0;
  const auto first = static_cast<std::size_t>(place);
  const auto weights = cubic_weights(place - static_cast<double>(first));
  double sum = 0.0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    // All but the shear are even in r.
    const bool mirrored = first + i == 0;
    const std::size_t point = mirrored ? 1 : first + i - 1;
    double value = 0.0;
    for (std::size_t k = 0; k < kRowWeights; ++k) {
      value += rows.weight[k] * values(field, rows.row[k])[point];
    }
    sum += weights[i] * (mirrored && field == kTauRz ? -value : value);
  }
  return sum;
}

AxisymmetricStress LayerField::stress(const ContactState& contact, double r_mm) const noexcept {
  const Rows rows = rows_of(contact);
  return {.sigma_r = at(rows, kSigmaR, r_mm),
          .sigma_theta = at(rows, kSigmaTheta, r_mm),
          .sigma_z = at(rows, kSigmaZ, r_mm),
          .tau_rz = at(rows, kTauRz, r_mm)};
}

double LayerField::displacement_mm(const ContactState& contact, double r_mm) const noexcept {
  return at(rows_of(contact), kDisplacement, r_mm);
}

double LayerField::radius_of_displacement_mm(const ContactState& contact,
                                             double displacement_mm) const noexcept {
  const Rows rows = rows_of(contact);
  const auto displaced = [&](std::size_t k) {
    return at(rows, kDisplacement, spacing_mm_ * static_cast<double>(k)) >= displacement_mm;
  };
  // The displacement falls smoothly: search in long strides, then point by point.
  constexpr std::size_t kStride = 8;
  std::size_t point = 0;
  while (point + kStride + 4 < points_ && displaced(point + kStride)) point += kStride;
  while (point + 4 < points_ && displaced(point)) ++point;
  if (point == 0) return 0.0;
  double low = spacing_mm_ * static_cast<double>(point - 1);
  double high = spacing_mm_ * static_cast<double>(point);
  while (high - low > 1e-6) {
    const double middle = 0.5 * (low + high);
    (at(rows, kDisplacement, middle) >= displacement_mm ? low : high) = middle;
  }
  return low;
}

}  // namespace merkel
