#pragma once

#include <vector>

namespace merkel {

/// A point of a quadrature rule: ∫ f ≈ Σ weight·f(x).
struct QuadratureNode {
  double x;
  double weight;
};

/// The n-point Gauss-Legendre rule on [low, high]: exact for polynomials of degree 2n−1.
/// Real-time: no.
[[nodiscard]] std::vector<QuadratureNode> gauss_legendre(int points, double low, double high);

}  // namespace merkel
