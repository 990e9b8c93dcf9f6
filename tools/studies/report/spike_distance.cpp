#include "tools/studies/report/spike_distance.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <vector>

namespace merkel {

double victor_purpura_distance(std::span<const double> a, std::span<const double> b,
                               double cost_per_s) {
  // row[j]: the cost of transforming the first i spikes of a into the first j of b.
  std::vector<double> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = static_cast<double>(j);
  for (std::size_t i = 0; i < a.size(); ++i) {
    double diagonal = row[0];
    row[0] = static_cast<double>(i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const double moved = diagonal + cost_per_s * std::fabs(a[i] - b[j]);
      diagonal = row[j + 1];
      row[j + 1] = std::min({row[j + 1] + 1.0, row[j] + 1.0, moved});
    }
  }
  return row.back();
}

double van_rossum_distance(std::span<const double> a, std::span<const double> b, double tau_s) {
  const auto overlap = [tau_s](std::span<const double> x, std::span<const double> y) {
    double sum = 0.0;
    for (const double s : x) {
      for (const double t : y) sum += std::exp(-std::fabs(s - t) / tau_s);
    }
    return sum;
  };
  const double square = 0.5 * overlap(a, a) + 0.5 * overlap(b, b) - overlap(a, b);
  return std::sqrt(std::max(0.0, square));
}

double vector_strength(std::span<const double> spikes, double frequency_hz) {
  if (spikes.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::complex<double> sum;
  for (const double t : spikes) {
    sum += std::polar(1.0, 2.0 * std::numbers::pi * frequency_hz * t);
  }
  return std::abs(sum) / static_cast<double>(spikes.size());
}

}  // namespace merkel
