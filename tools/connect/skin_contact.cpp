#include "tools/connect/skin_contact.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

#include "core/math/line_fit.hpp"

namespace merkel {
namespace {

constexpr std::size_t kRest = 50;  ///< readings from which the noise is known
constexpr double kMinForce_N = 1e-3;
constexpr double kNoisesOfTouch = 6.0;
constexpr double kEndOfTouch = 0.5;  ///< of the force at which it began
constexpr std::size_t kInARow = 3;
constexpr double kFitted = 20.0;  ///< forces up to so many thresholds are fitted

}  // namespace

std::optional<double> skin_depth_mm(std::span<const double> depth_mm,
                                    std::span<const double> force_N) {
  const std::size_t size = std::min(depth_mm.size(), force_N.size());
  if (size < kRest + kInARow) return std::nullopt;
  const auto rest = force_N.first(kRest);
  const double zero = std::accumulate(rest.begin(), rest.end(), 0.0) / static_cast<double>(kRest);
  double squares = 0.0;
  for (const double force : rest) squares += (force - zero) * (force - zero);
  const double noise = std::sqrt(squares / static_cast<double>(kRest));
  const double threshold = std::max(kNoisesOfTouch * noise, kMinForce_N);
  std::size_t in_a_row = 0;
  std::size_t onset = kRest;
  for (; onset < size && in_a_row < kInARow; ++onset) {
    in_a_row = force_N[onset] - zero > threshold ? in_a_row + 1 : 0;
  }
  if (in_a_row < kInARow) return std::nullopt;
  onset -= kInARow;
  // The line of force^(2/3) over depth meets 0 at the skin.
  std::vector<std::pair<double, double>> points;  // mm from the onset, force^(2/3)
  for (std::size_t i = onset; i < size; ++i) {
    const double force = force_N[i] - zero;
    if (force < kEndOfTouch * threshold || force > kFitted * threshold) break;
    points.emplace_back(depth_mm[i] - depth_mm[onset], std::cbrt(force * force));
  }
  const FittedLine line = fit_line(points);
  const double skin = line.mean_x - line.mean_y / line.slope();
  // A force without a movement, or of a depth that falls, is no touch of a probe that is lowered.
  if (!(line.slope() > 0.0) || !std::isfinite(skin)) return std::nullopt;
  return depth_mm[onset] + skin;
}

}  // namespace merkel
