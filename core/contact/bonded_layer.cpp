#include "core/contact/bonded_layer.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Dense>

namespace merkel {
namespace {

using std::numbers::pi;

constexpr int kContactNodes = 16;  ///< on 0 … a
constexpr int kTableRows = 97;

}  // namespace

double dimitriadis_factor(double chi, double nu) noexcept {
  const double alpha = -(1.2876 - 1.4678 * nu + 1.3442 * nu * nu) / (1.0 - nu);
  const double beta = (0.6387 - 1.0277 * nu + 1.5164 * nu * nu) / (1.0 - nu);
  const double alpha3 = alpha * alpha * alpha;
  const double c1 = -2.0 * alpha / pi;
  const double c2 = 4.0 * alpha * alpha / (pi * pi);
  const double c3 = -8.0 / std::pow(pi, 3) * (alpha3 + 4.0 * pi * pi / 15.0 * beta);
  const double c4 = 16.0 * alpha / std::pow(pi, 4) * (alpha3 + 3.0 * pi * pi / 5.0 * beta);
  return 1.0 + chi * (c1 + chi * (c2 + chi * (c3 + chi * c4)));
}

double LayerEquation::stiffening(double x, double poisson_ratio) noexcept {
  const double kappa = 3.0 - 4.0 * poisson_ratio;
  // Numerator and denominator of K, both divided by e^{2x}.
  const double e = std::exp(-2.0 * x);
  const double denominator = kappa * (1.0 + e * e) + (kappa * kappa + 1.0 + 4.0 * x * x) * e;
  const double numerator = kappa * (1.0 - e * e) - 4.0 * x * e;
  return 1.0 - numerator / denominator;
}

LayerEquation::LayerEquation(double poisson_ratio) : nodes_(gauss_legendre(96, 0.0, 14.0)) {
  for (QuadratureNode& node : nodes_) node.weight *= stiffening(node.x, poisson_ratio);
}

double LayerEquation::kernel(double y) const noexcept {
  double sum = 0.0;
  for (const QuadratureNode& node : nodes_) sum += node.weight * std::cos(node.x * y);
  return sum;
}

LayerContact LayerEquation::solve(double a) const {
  LayerContact contact{.radius = a, .depth = 0.0, .force = 0.0, .nodes = {}, .phi = {}};
  if (!(a > 0.0)) {
    contact.nodes = {{.x = 0.0, .weight = 1.0}};
    contact.phi = {1.0};
    return contact;
  }
  contact.nodes = gauss_legendre(kContactNodes, 0.0, a);
  const auto couple = [&](double x, const QuadratureNode& t) {
    return (kernel(x - t.x) + kernel(x + t.x)) * t.weight / pi;
  };
  Eigen::MatrixXd matrix(kContactNodes, kContactNodes);
  Eigen::MatrixXd right(kContactNodes, 2);  // φ = d·φ_unit − φ_parabola
  for (int i = 0; i < kContactNodes; ++i) {
    const double x = contact.nodes[static_cast<std::size_t>(i)].x;
    for (int j = 0; j < kContactNodes; ++j) {
      matrix(i, j) = (i == j ? 1.0 : 0.0) - couple(x, contact.nodes[static_cast<std::size_t>(j)]);
    }
    right(i, 0) = 1.0;
    right(i, 1) = x * x;
  }
  const Eigen::MatrixXd phi = matrix.partialPivLu().solve(right);
  double unit_at_rim = 1.0;
  double parabola_at_rim = a * a;
  for (int j = 0; j < kContactNodes; ++j) {
    const double coupling = couple(a, contact.nodes[static_cast<std::size_t>(j)]);
    unit_at_rim += coupling * phi(j, 0);
    parabola_at_rim += coupling * phi(j, 1);
  }
  contact.depth = parabola_at_rim / unit_at_rim;
  for (int j = 0; j < kContactNodes; ++j) {
    contact.phi.push_back(contact.depth * phi(j, 0) - phi(j, 1));
    contact.force += 2.0 * contact.nodes[static_cast<std::size_t>(j)].weight * contact.phi.back();
  }
  return contact;
}

BondedLayer::BondedLayer(double poisson_ratio, double largest_chi) {
  const LayerEquation equation(poisson_ratio);
  rows_.push_back({.chi = 0.0, .force = 1.0, .radius = 1.0});
  // The cubic takes two rows on each side, and four at least.
  int beyond = 0;
  for (int row = 1; row < kTableRows && (beyond < 2 || rows_.size() < 5); ++row) {
    const LayerContact contact = equation.solve(kLargestRadius * row / (kTableRows - 1));
    const double chi = std::sqrt(contact.depth);
    if (chi > largest_chi) ++beyond;
    rows_.push_back({.chi = chi,
                     .force = contact.force / (4.0 / 3.0 * contact.depth * chi),
                     .radius = contact.radius / chi});
  }
}

double BondedLayer::look_up(double chi, double Row::*member) const noexcept {
  const Row& last = rows_.back();
  if (chi >= last.chi) {
    const Row& before = rows_[rows_.size() - 2];
    const double power = std::log(last.*member / before.*member) / std::log(last.chi / before.chi);
    return last.*member * std::pow(chi / last.chi, power);
  }
  // The cubic through the four rows around χ.
  const auto above = std::upper_bound(rows_.begin(), rows_.end(), chi,
                                      [](double value, const Row& row) { return value < row.chi; });
  const std::ptrdiff_t first = std::clamp<std::ptrdiff_t>(
      above - rows_.begin() - 2, 0, static_cast<std::ptrdiff_t>(rows_.size()) - 4);
  double sum = 0.0;
  for (std::ptrdiff_t i = first; i < first + 4; ++i) {
    double term = rows_[static_cast<std::size_t>(i)].*member;
    for (std::ptrdiff_t j = first; j < first + 4; ++j) {
      if (j == i) continue;
      const double other = rows_[static_cast<std::size_t>(j)].chi;
      term *= (chi - other) / (rows_[static_cast<std::size_t>(i)].chi - other);
    }
    sum += term;
  }
  return sum;
}

double BondedLayer::force_factor(double chi) const noexcept { return look_up(chi, &Row::force); }

double BondedLayer::radius_factor(double chi) const noexcept { return look_up(chi, &Row::radius); }

}  // namespace merkel
