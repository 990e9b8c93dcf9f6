#include "tools/studies/report/rank_correlation.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

#include "core/math/line_fit.hpp"

namespace merkel {
namespace {

std::vector<double> ranks(std::span<const double> values) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  std::vector<double> rank(values.size());
  for (std::size_t begin = 0; begin < order.size();) {
    std::size_t end = begin;
    while (end < order.size() && values[order[end]] == values[order[begin]]) ++end;
    const double shared = 0.5 * static_cast<double>(begin + end - 1);
    for (std::size_t i = begin; i < end; ++i) rank[order[i]] = shared;
    begin = end;
  }
  return rank;
}

double pearson(const std::vector<double>& x, const std::vector<double>& y) {
  std::vector<std::pair<double, double>> pairs;
  for (std::size_t i = 0; i < x.size(); ++i) pairs.emplace_back(x[i], y[i]);
  const FittedLine line = fit_line(pairs);
  return line.xx > 0.0 && line.yy > 0.0 ? line.xy / std::sqrt(line.xx * line.yy) : 0.0;
}

}  // namespace

double spearman(std::span<const double> x, std::span<const double> y) {
  assert(x.size() == y.size());
  return pearson(ranks(x), ranks(y));
}

double partial_spearman(std::span<const double> x, std::span<const double> y,
                        std::span<const double> z) {
  const double xy = spearman(x, y);
  const double xz = spearman(x, z);
  const double yz = spearman(y, z);
  const double left = (1.0 - xz * xz) * (1.0 - yz * yz);
  return left > 1e-12 ? (xy - xz * yz) / std::sqrt(left) : 0.0;
}

}  // namespace merkel
