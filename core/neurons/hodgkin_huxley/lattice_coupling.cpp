#include "core/neurons/hodgkin_huxley/lattice_coupling.hpp"

#include <algorithm>

#include "core/math/random.hpp"

namespace merkel {

FieldTable NetworkParameters::fields() {
  using P = NetworkParameters;
  static constexpr Field kFields[] = {
      {"gain", "mS/cm²", not_negative(1e6),
       "coupling between neighbouring afferents; 0: no network", at<&P::gain>},
      {"weight_min", "", not_negative(1e6), "smallest weight of a connection", at<&P::weight_min>},
      {"weight_max", "", not_negative(1e6), "largest weight of a connection", at<&P::weight_max>},
      {"seed", "", any_value(), "seed of the weights", at<&P::seed>}};
  return {"network", kFields};
}

Expected<void, ParameterError> NetworkParameters::check() const {
  return ParameterCheck()
      .fields(*this)
      .require(weight_min <= weight_max, "network.weight_min", "must not exceed weight_max")
      .result();
}

LatticeCoupling::LatticeCoupling(double gain, int columns, int rows)
    : gain_(gain),
      columns_(static_cast<std::size_t>(columns)),
      to_next_column_(columns_ * static_cast<std::size_t>(rows)),
      to_next_row_(to_next_column_.size()),
      conductance_(to_next_column_.size()) {}

Expected<LatticeCoupling, ParameterError> LatticeCoupling::create(
    const NetworkParameters& parameters, int columns, int rows) {
  if (const auto checked = parameters.check(); !checked) {
    return Unexpected<ParameterError>(checked.error());
  }
  LatticeCoupling network(parameters.gain, columns, rows);
  Random random(parameters.seed);
  const auto draw = [&] {
    return parameters.gain * random.uniform(parameters.weight_min, parameters.weight_max);
  };
  const std::size_t count = network.neurons();
  for (std::size_t n = 0; n < count; ++n) {
    if ((n + 1) % network.columns_ != 0) network.to_next_column_[n] = draw();
    if (n + network.columns_ < count) network.to_next_row_[n] = draw();
  }
  for (std::size_t n = 0; n < count; ++n) {
    if (n + 1 < count) {
      network.conductance_[n] += network.to_next_column_[n];
      network.conductance_[n + 1] += network.to_next_column_[n];
    }
    if (n + network.columns_ < count) {
      network.conductance_[n] += network.to_next_row_[n];
      network.conductance_[n + network.columns_] += network.to_next_row_[n];
    }
  }
  return network;
}

double LatticeCoupling::largest_conductance() const noexcept {
  return *std::max_element(conductance_.begin(), conductance_.end());
}

}  // namespace merkel
