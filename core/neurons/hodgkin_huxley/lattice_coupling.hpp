#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/parameters/parameter_error.hpp"

namespace merkel {

/// Diffusive coupling of neighbouring afferents; gain 0 disables the network.
struct NetworkParameters {
  double gain = 0.1;        ///< κ, mS/cm²
  double weight_min = 0.1;  ///< w ~ U(min, max), dimensionless
  double weight_max = 0.3;
  std::uint64_t seed = 1;

  [[nodiscard]] static FieldTable fields();
  [[nodiscard]] Expected<void, ParameterError> check() const;
};

/// The network of a columns × rows grid of neurons. Every neuron exchanges the current κ·Σ_j
/// w_nj(V_j − V_n) with up to four neighbours; w is symmetric (the paper's Eq. 11 lacks the term).
/// A 5 × 4 grid has 31 edges.
class LatticeCoupling {
 public:
  /// Weights are drawn neuron by neuron: first the edge to the next column, then to the next row.
  [[nodiscard]] static Expected<LatticeCoupling, ParameterError> create(
      const NetworkParameters& parameters, int columns, int rows);

  [[nodiscard]] bool active() const noexcept { return gain_ > 0.0; }
  [[nodiscard]] std::size_t neurons() const noexcept { return to_next_column_.size(); }
  [[nodiscard]] std::size_t columns() const noexcept { return columns_; }

  /// κ·w to the neuron in the next column (index n+1) and the next row (n+columns); 0 at the
  /// borders. Indices start at 0; mS/cm².
  [[nodiscard]] std::span<const double> to_next_column() const noexcept { return to_next_column_; }
  [[nodiscard]] std::span<const double> to_next_row() const noexcept { return to_next_row_; }
  /// κ·Σ_j w_nj of every neuron, mS/cm².
  [[nodiscard]] std::span<const double> conductance() const noexcept { return conductance_; }
  [[nodiscard]] double largest_conductance() const noexcept;

 private:
  LatticeCoupling(double gain, int columns, int rows);

  double gain_;
  std::size_t columns_;
  std::vector<double> to_next_column_;
  std::vector<double> to_next_row_;
  std::vector<double> conductance_;
};

}  // namespace merkel
