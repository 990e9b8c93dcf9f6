#include "core/contact/layer_table.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

#include <Eigen/Dense>
#include <math.h>  // j0, j1 of POSIX

#include "core/contact/bonded_layer.hpp"
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

/// The pressure of every row's contact per force, by wave number, and its displacement of a
/// half-space.
struct Contacts {
  Eigen::MatrixXd pressure;  ///< [row][ξ]
  std::vector<HalfSpaceDisplacement> displacement;
};

Contacts contacts_of(const LayerTable& table, const SkinParameters& skin,
                     const std::vector<QuadratureNode>& xi) {
  const double h = skin.thickness_mm;
  const auto rows = static_cast<Eigen::Index>(table.rows);
  const auto count = static_cast<Eigen::Index>(xi.size());
  const LayerEquation equation(skin.poisson_ratio);
  Contacts contacts{.pressure = Eigen::MatrixXd(rows, count), .displacement = {}};
  for (Eigen::Index row = 0; row < rows; ++row) {
    const LayerContact contact =
        equation.solve(table.row_spacing_mm * static_cast<double>(row) / h);
    for (Eigen::Index k = 0; k < count; ++k) {
      contacts.pressure(row, k) = pressure_of(contact, h, xi[static_cast<std::size_t>(k)].x);
    }
    contacts.displacement.emplace_back(contact, h);
  }
  return contacts;
}

/// The Bessel functions at every wave number and point, [ξ][point].
struct BesselFunctions {
  Eigen::MatrixXd j0;
  Eigen::MatrixXd j1;
  Eigen::MatrixXd j1_over_r;
};

BesselFunctions bessel_functions(const LayerTable& table, const std::vector<QuadratureNode>& xi) {
  const auto points = static_cast<Eigen::Index>(table.points);
  const auto count = static_cast<Eigen::Index>(xi.size());
  BesselFunctions bessel{.j0 = Eigen::MatrixXd(count, points),
                         .j1 = Eigen::MatrixXd(count, points),
                         .j1_over_r = Eigen::MatrixXd(count, points)};
  for (Eigen::Index point = 0; point < points; ++point) {
    const double r = table.spacing_mm * static_cast<double>(point);
    for (Eigen::Index k = 0; k < count; ++k) {
      const double x = xi[static_cast<std::size_t>(k)].x;
      bessel.j0(k, point) = ::j0(x * r);
      bessel.j1(k, point) = ::j1(x * r);
      bessel.j1_over_r(k, point) = point == 0 ? 0.5 * x : bessel.j1(k, point) / r;
    }
  }
  return bessel;
}

/// The layer's responses at receptor depth, weighted for the integral over ξ.
struct Kernels {
  explicit Kernels(Eigen::Index count)
      : wave(count), radial(count), gradient(count), dilatation(count), shear(count), bone(count) {}

  Eigen::ArrayXd wave;  ///< ξ
  Eigen::ArrayXd radial;
  Eigen::ArrayXd gradient;
  Eigen::ArrayXd dilatation;
  Eigen::ArrayXd shear;
  Eigen::ArrayXd bone;  ///< reduction of the half-space's displacement by the bone
};

Kernels kernels_of(const SkinParameters& skin, const std::vector<QuadratureNode>& xi) {
  const double h = skin.thickness_mm;
  const double nu = skin.poisson_ratio;
  const double modulus = SkinMaterial(skin).reduced_modulus_kPa();
  const auto count = static_cast<Eigen::Index>(xi.size());
  Kernels kernels(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto& [x, weight] = xi[static_cast<std::size_t>(k)];
    const LayerResponse at = response(x, skin.receptor_depth_mm, h, nu);
    kernels.wave(k) = x;
    kernels.radial(k) = weight * x * at.radial;
    kernels.gradient(k) = weight * x * at.gradient;
    kernels.dilatation(k) = weight * x * at.dilatation;
    kernels.shear(k) = weight * x * at.shear;
    kernels.bone(k) = -2.0 / modulus * weight * LayerEquation::stiffening(x * h, nu);
  }
  return kernels;
}

/// The table's size: `spacing_mm`, `points`, `row_spacing_mm` and `rows`.
LayerTable empty_table(const SkinParameters& skin, double largest_mm) {
  LayerTable table{.spacing_mm = std::clamp(0.1 * skin.receptor_depth_mm, 0.01, 0.1)};
  table.rows =
      std::clamp(static_cast<std::size_t>(std::ceil(6.0 * largest_mm / skin.receptor_depth_mm)),
                 std::size_t{8}, kMostRows) +
      1;
  table.row_spacing_mm = largest_mm / static_cast<double>(table.rows - 1);
  table.points =
      std::min(LayerTable::kMostPoints,
               static_cast<std::size_t>((largest_mm + kFarthest_thicknesses * skin.thickness_mm) /
                                        table.spacing_mm));
  table.values.resize(LayerTable::kFields * table.rows * table.points);
  return table;
}

}  // namespace

LayerTable layer_table(const SkinParameters& skin, double largest_radius_mm) {
  assert(skin.layered() && skin.receptor_depth_mm >= LayerTable::kLeastDepth_mm);
  const double z = skin.receptor_depth_mm;
  const double largest = std::min(std::max(largest_radius_mm, 0.1 * z),
                                  BondedLayer::kLargestRadius * skin.thickness_mm);
  LayerTable table = empty_table(skin, largest);
  const double farthest = table.spacing_mm * static_cast<double>(table.points - 1);
  const auto xi = wave_numbers(z, farthest + largest);
  const Contacts contacts = contacts_of(table, skin, xi);
  const BesselFunctions bessel = bessel_functions(table, xi);
  const Kernels kernels = kernels_of(skin, xi);

  // ε_r = ∫ξ²U·J0 − ∫ξU·J1/r, ε_θ = ∫ξU·J1/r, ε_z = ∫ξW'·J0; σ = 2G·(ε + ν·e/(1−2ν)).
  const auto transform = [&](const Eigen::ArrayXd& kernel, const Eigen::MatrixXd& functions) {
    return Eigen::MatrixXd(contacts.pressure * kernel.matrix().asDiagonal() * functions);
  };
  const auto rows = static_cast<Eigen::Index>(table.rows);
  const auto points = static_cast<Eigen::Index>(table.points);
  const auto keep = [&](LayerTable::Field field, const Eigen::MatrixXd& values) {
    for (Eigen::Index row = 0; row < rows; ++row) {
      double* const to = table.of(field, static_cast<std::size_t>(row));
      for (Eigen::Index point = 0; point < points; ++point) to[point] = values(row, point);
    }
  };
  const Eigen::MatrixXd hoop = transform(kernels.radial, bessel.j1_over_r);
  const Eigen::MatrixXd mean = skin.poisson_ratio * transform(kernels.dilatation, bessel.j0);
  keep(LayerTable::kSigmaR, transform(kernels.wave * kernels.radial, bessel.j0) - hoop + mean);
  keep(LayerTable::kSigmaTheta, hoop + mean);
  keep(LayerTable::kSigmaZ, transform(kernels.gradient, bessel.j0) + mean);
  keep(LayerTable::kTauRz, transform(kernels.shear, bessel.j1));
  const double modulus = SkinMaterial(skin).reduced_modulus_kPa();
  Eigen::MatrixXd surface = transform(kernels.bone, bessel.j0);
  for (Eigen::Index row = 0; row < rows; ++row) {
    const auto& displacement = contacts.displacement[static_cast<std::size_t>(row)];
    for (Eigen::Index point = 0; point < points; ++point) {
      surface(row, point) += displacement(table.spacing_mm * static_cast<double>(point)) / modulus;
    }
  }
  keep(LayerTable::kDisplacement, surface);
  return table;
}

}  // namespace merkel
