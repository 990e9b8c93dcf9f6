#include "tools/studies/reference/bonded_layer.hpp"

#include <cmath>
#include <numbers>
#include <utility>

#include <Eigen/LU>

namespace merkel::reference {
namespace {

/// Nodes and weights of Gauss and Legendre on [0, end]: the roots of the polynomial by Newton's
/// method, each from Tricomi's estimate.
std::vector<std::pair<double, double>> gauss_nodes(int count, double end) {
  std::vector<std::pair<double, double>> nodes;
  for (int k = 0; k < count; ++k) {
    double x = std::cos(std::numbers::pi * (k + 0.75) / (count + 0.5));
    double slope = 1.0;
    for (int pass = 0; pass < 8; ++pass) {
      double before = 1.0;
      double value = x;
      for (int n = 1; n < count; ++n) {
        before = std::exchange(value, ((2 * n + 1) * x * value - n * before) / (n + 1));
      }
      slope = count * (x * value - before) / (x * x - 1.0);
      x -= value / slope;
    }
    nodes.emplace_back(0.5 * end * (1.0 + x), end / ((1.0 - x * x) * slope * slope));
  }
  return nodes;
}

}  // namespace

double BondedLayer::stiffening(double x, double poisson_ratio) {
  const double kappa = 3.0 - 4.0 * poisson_ratio;
  // Numerator and denominator of K, both divided by e^{2x}.
  const double e = std::exp(-2.0 * x);
  const double denominator = kappa * (1.0 + e * e) + (kappa * kappa + 1.0 + 4.0 * x * x) * e;
  return 1.0 - (kappa * (1.0 - e * e) - 4.0 * x * e) / denominator;
}

BondedLayer::BondedLayer(double poisson_ratio) : nodes_(gauss_nodes(96, 14.0)) {
  for (auto& [x, weight] : nodes_) weight *= stiffening(x, poisson_ratio);
}

std::pair<double, double> BondedLayer::solve(double radius) const {
  constexpr int kNodes = 16;
  const auto nodes = gauss_nodes(kNodes, radius);
  const auto kernel = [&](double y) {
    double sum = 0.0;
    for (const auto& [x, weight] : nodes_) sum += weight * std::cos(x * y);
    return sum;
  };
  const auto couple = [&](double x, const std::pair<double, double>& t) {
    return (kernel(x - t.first) + kernel(x + t.first)) * t.second / std::numbers::pi;
  };
  Eigen::MatrixXd matrix(kNodes, kNodes);
  Eigen::MatrixXd right(kNodes, 2);  // φ = d·φ_unit − φ_parabola
  for (int i = 0; i < kNodes; ++i) {
    const double x = nodes[static_cast<std::size_t>(i)].first;
    for (int j = 0; j < kNodes; ++j) {
      matrix(i, j) = (i == j ? 1.0 : 0.0) - couple(x, nodes[static_cast<std::size_t>(j)]);
    }
    right(i, 0) = 1.0;
    right(i, 1) = x * x;
  }
  const Eigen::MatrixXd phi = matrix.partialPivLu().solve(right);
  Eigen::RowVector2d at_rim(1.0, radius * radius);
  Eigen::RowVector2d force = Eigen::RowVector2d::Zero();
  for (int j = 0; j < kNodes; ++j) {
    const auto& node = nodes[static_cast<std::size_t>(j)];
    at_rim += couple(radius, node) * phi.row(j);
    force += 2.0 * node.second * phi.row(j);
  }
  const double depth = at_rim(1) / at_rim(0);
  return {depth, depth * force(0) - force(1)};
}

BondedLayer::Factors BondedLayer::factors(double chi) const {
  if (!(chi > 0.0)) return {};
  // Bone widens the contact, at most to twice the radius.
  double low = 0.9 * chi;
  double high = 2.1 * chi;
  for (int halving = 0; halving < 40; ++halving) {
    const double middle = 0.5 * (low + high);
    (solve(middle).first < chi * chi ? low : high) = middle;
  }
  const auto [depth, force] = solve(high);
  return {.force = force / (4.0 / 3.0 * chi * chi * chi), .radius = high / chi};
}

}  // namespace merkel::reference
