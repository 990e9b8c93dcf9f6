#include "tests/reference/layer_finite_elements.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Dense>
#include <Eigen/Sparse>

namespace merkel::reference {
namespace {

using Shape = Eigen::Matrix<double, 4, 8>;  // ε_r, ε_θ, ε_z, γ_rz of the nodes' (u_r, u_z)

/// Mesh lines: uniform up to `even_to`, then each element is a tenth larger.
std::vector<double> graded(double even_to, double end, double size) {
  std::vector<double> lines{0.0};
  while (lines.back() < even_to) lines.push_back(lines.back() + size);
  for (double step = 1.1 * size; lines.back() + 1.5 * step < end; step *= 1.1) {
    lines.push_back(lines.back() + step);
  }
  lines.push_back(end);
  return lines;
}

struct Element {
  double r0, r1, z0, z1;

  [[nodiscard]] double r_at(double s) const { return r0 + (r1 - r0) * 0.5 * (1.0 + s); }
  /// Strains at (s, t) in [−1, 1]², node order: (r0,z0), (r1,z0), (r1,z1), (r0,z1).
  [[nodiscard]] Shape strain(double s, double t) const {
    constexpr double kS[] = {-1, 1, 1, -1};
    constexpr double kT[] = {-1, -1, 1, 1};
    Shape b = Shape::Zero();
    for (int n = 0; n < 4; ++n) {
      const double value = 0.25 * (1.0 + kS[n] * s) * (1.0 + kT[n] * t);
      const double dr = 0.25 * kS[n] * (1.0 + kT[n] * t) * 2.0 / (r1 - r0);
      const double dz = 0.25 * kT[n] * (1.0 + kS[n] * s) * 2.0 / (z1 - z0);
      b(0, 2 * n) = dr;
      b(1, 2 * n) = value / r_at(s);
      b(2, 2 * n + 1) = dz;
      b(3, 2 * n) = dz;
      b(3, 2 * n + 1) = dr;
    }
    return b;
  }
  /// The same with the element's mean dilatation.
  [[nodiscard]] Shape mean_dilatation(const Shape& b,
                                      const Eigen::Matrix<double, 1, 8>& mean) const {
    Shape result = b;
    const Eigen::Matrix<double, 1, 8> missing = (mean - b.topRows<3>().colwise().sum()) / 3.0;
    for (int i = 0; i < 3; ++i) result.row(i) += missing;
    return result;
  }
  [[nodiscard]] Eigen::Matrix<double, 1, 8> mean() const {
    Eigen::Matrix<double, 1, 8> sum = Eigen::Matrix<double, 1, 8>::Zero();
    double volume = 0.0;
    for (const double s : {-kGauss, kGauss}) {
      for (const double t : {-kGauss, kGauss}) {
        sum += strain(s, t).topRows<3>().colwise().sum() * r_at(s);
        volume += r_at(s);
      }
    }
    return sum / volume;
  }
  [[nodiscard]] Eigen::Matrix<double, 8, 8> stiffness(const Eigen::Matrix4d& D) const {
    const auto dilatation = mean();
    Eigen::Matrix<double, 8, 8> K = Eigen::Matrix<double, 8, 8>::Zero();
    for (const double s : {-kGauss, kGauss}) {
      for (const double t : {-kGauss, kGauss}) {
        const Shape B = mean_dilatation(strain(s, t), dilatation);
        K += B.transpose() * D * B * (2.0 * std::numbers::pi * r_at(s) * quarter());
      }
    }
    return K;
  }
  [[nodiscard]] double quarter() const { return 0.25 * (r1 - r0) * (z1 - z0); }

  static constexpr double kGauss = 0.57735026918962576;
};

Eigen::Matrix4d elasticity(double E, double nu) {
  const double lambda = E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
  const double G = E / (2.0 * (1.0 + nu));
  Eigen::Matrix4d d = Eigen::Matrix4d::Zero();
  d.topLeftCorner<3, 3>().setConstant(lambda);
  for (int i = 0; i < 3; ++i) d(i, i) += 2.0 * G;
  d(3, 3) = G;
  return d;
}

Eigen::Matrix4d elasticity_at(const LayerFiniteElements::Parameters& p, const Element& element) {
  const bool upper = 0.5 * (element.z0 + element.z1) < p.upper_mm;
  return elasticity(upper ? p.upper_kPa : p.youngs_modulus_kPa, p.poisson_ratio);
}

/// Sets the displacements that are not fixed to the equilibrium without load.
void solve_free(const Eigen::SparseMatrix<double>& K, const std::vector<bool>& fixed,
                Eigen::VectorXd& u) {
  std::vector<int> place;  // of each unknown among the free ones, or −1
  int free = 0;
  for (const bool is_fixed : fixed) place.push_back(is_fixed ? -1 : free++);
  const Eigen::VectorXd load = -(K * u);
  std::vector<Eigen::Triplet<double>> kept;
  for (Eigen::Index column = 0; column < K.cols(); ++column) {
    for (Eigen::SparseMatrix<double>::InnerIterator it(K, column); it; ++it) {
      const int i = place[static_cast<std::size_t>(it.row())];
      const int j = place[static_cast<std::size_t>(it.col())];
      if (i >= 0 && j >= 0) kept.emplace_back(i, j, it.value());
    }
  }
  Eigen::SparseMatrix<double> reduced(free, free);
  reduced.setFromTriplets(kept.begin(), kept.end());
  Eigen::VectorXd right(free);
  for (Eigen::Index i = 0; i < u.size(); ++i) {
    const int at = place[static_cast<std::size_t>(i)];
    if (at >= 0) right(at) = load(i);
  }
  const Eigen::VectorXd solved =
      Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(reduced).solve(right);
  for (Eigen::Index i = 0; i < u.size(); ++i) {
    const int at = place[static_cast<std::size_t>(i)];
    if (at >= 0) u(i) = solved(at);
  }
}

}  // namespace

LayerFiniteElements::LayerFiniteElements(const Parameters& p) {
  const double near = 1.6 * std::sqrt(p.radius_mm * p.depth_mm) + 0.5;
  r_ = graded(near, near + 8.0 * p.thickness_mm, p.element_mm);
  z_ = graded(std::min(1.5, 0.5 * p.thickness_mm), p.thickness_mm, p.element_mm);
  const std::size_t nodes = r_.size() * z_.size();

  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t row = 0; row + 1 < z_.size(); ++row) {
    for (std::size_t column = 0; column + 1 < r_.size(); ++column) {
      const Element element{r_[column], r_[column + 1], z_[row], z_[row + 1]};
      const Eigen::Matrix<double, 8, 8> K = element.stiffness(elasticity_at(p, element));
      const std::size_t of[] = {node(column, row), node(column + 1, row), node(column + 1, row + 1),
                                node(column, row + 1)};
      for (int i = 0; i < 8; ++i) {
        for (int j = 0; j < 8; ++j) {
          entries.emplace_back(static_cast<int>(2 * of[i / 2]) + i % 2,
                               static_cast<int>(2 * of[j / 2]) + j % 2, K(i, j));
        }
      }
    }
  }
  const auto all = static_cast<Eigen::Index>(2 * nodes);
  Eigen::SparseMatrix<double> K(all, all);
  K.setFromTriplets(entries.begin(), entries.end());

  std::vector<bool> touching(r_.size());
  for (std::size_t i = 0; i < r_.size(); ++i)
    touching[i] = r_[i] < std::sqrt(p.radius_mm * p.depth_mm);
  const auto wanted = [&](std::size_t column) {
    return p.depth_mm - r_[column] * r_[column] / (2.0 * p.radius_mm);
  };
  Eigen::VectorXd u;
  for (int pass = 0; pass < 40; ++pass) {
    std::vector<bool> fixed(static_cast<std::size_t>(all));
    u = Eigen::VectorXd::Zero(all);
    for (std::size_t column = 0; column < r_.size(); ++column) {
      fixed[2 * node(column, z_.size() - 1)] = true;
      fixed[2 * node(column, z_.size() - 1) + 1] = true;
      if (!touching[column]) continue;
      fixed[2 * column + 1] = true;
      u(static_cast<Eigen::Index>(2 * column + 1)) = wanted(column);
    }
    for (std::size_t row = 0; row < z_.size(); ++row) fixed[2 * node(0, row)] = true;
    solve_free(K, fixed, u);
    const Eigen::VectorXd reaction = K * u;
    bool changed = false;
    force_mN_ = 0.0;
    contact_radius_mm_ = 0.0;
    for (std::size_t column = 0; column + 1 < r_.size(); ++column) {
      const auto dof = static_cast<Eigen::Index>(2 * column + 1);
      if (touching[column]) {
        force_mN_ += reaction(dof);
        contact_radius_mm_ = 0.5 * (r_[column] + r_[column + 1]);
        if (reaction(dof) < 0.0) {
          touching[column] = false;
          changed = true;
        }
      } else if (u(dof) < wanted(column)) {
        touching[column] = true;
        changed = true;
      }
    }
    if (!changed) break;
  }
  fill_centres({u.data(), u.data() + u.size()}, p);
}

void LayerFiniteElements::fill_centres(const std::vector<double>& u, const Parameters& p) {
  for (std::size_t row = 0; row + 1 < z_.size(); ++row) {
    for (std::size_t column = 0; column + 1 < r_.size(); ++column) {
      const Element element{r_[column], r_[column + 1], z_[row], z_[row + 1]};
      const std::size_t of[] = {node(column, row), node(column + 1, row), node(column + 1, row + 1),
                                node(column, row + 1)};
      Eigen::Matrix<double, 8, 1> own;
      for (int i = 0; i < 8; ++i) own(i) = u[2 * of[i / 2] + static_cast<std::size_t>(i % 2)];
      const Eigen::Vector4d stress =
          elasticity_at(p, element) *
          element.mean_dilatation(element.strain(0.0, 0.0), element.mean()) * own;
      centres_.push_back({.sigma_r = stress(0),
                          .sigma_theta = stress(1),
                          .sigma_z = stress(2),
                          .tau_rz = stress(3)});
    }
  }
}

AxisymmetricStress LayerFiniteElements::stress(double r_mm, double z_mm) const {
  const auto place = [](const std::vector<double>& lines, double x) {
    std::size_t i = 0;
    while (i + 3 < lines.size() && 0.5 * (lines[i + 1] + lines[i + 2]) < x) ++i;
    const double a = 0.5 * (lines[i] + lines[i + 1]);
    const double b = 0.5 * (lines[i + 1] + lines[i + 2]);
    return std::pair{i, std::clamp((x - a) / (b - a), 0.0, 1.0)};
  };
  const auto [i, s] = place(r_, r_mm);
  const auto [j, t] = place(z_, z_mm);
  const auto blend = [&, i = i, s = s, j = j, t = t](double AxisymmetricStress::*part) {
    const auto at = [&](std::size_t column, std::size_t row) {
      return centres_[row * (r_.size() - 1) + column].*part;
    };
    return (1.0 - t) * ((1.0 - s) * at(i, j) + s * at(i + 1, j)) +
           t * ((1.0 - s) * at(i, j + 1) + s * at(i + 1, j + 1));
  };
  return {.sigma_r = blend(&AxisymmetricStress::sigma_r),
          .sigma_theta = blend(&AxisymmetricStress::sigma_theta),
          .sigma_z = blend(&AxisymmetricStress::sigma_z),
          .tau_rz = blend(&AxisymmetricStress::tau_rz)};
}

}  // namespace merkel::reference
