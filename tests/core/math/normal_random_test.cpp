#include "core/math/normal_random.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include <gtest/gtest.h>

namespace merkel {
namespace {

std::vector<double> numbers_of(std::uint64_t seed, std::uint64_t streams, std::uint64_t steps) {
  std::vector<double> numbers;
  for (std::uint64_t stream = 0; stream < streams; ++stream) {
    for (std::uint64_t step = 0; step < steps; ++step) {
      numbers.push_back(normal_random(seed, stream, step));
    }
  }
  return numbers;
}

TEST(NormalRandom, FollowsTheNormalDistribution) {
  std::vector<double> numbers = numbers_of(1, 100, 2000);
  std::sort(numbers.begin(), numbers.end());
  const auto count = static_cast<double>(numbers.size());
  double farthest = 0.0;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const double expected = 0.5 * std::erfc(-numbers[i] / std::sqrt(2.0));
    farthest = std::max(farthest, std::fabs(expected - (static_cast<double>(i) + 0.5) / count));
  }
  // Kolmogorov-Smirnov at the 1 % level.
  EXPECT_LT(farthest, 1.63 / std::sqrt(count));
  EXPECT_LT(numbers.front(), -4.0);
  EXPECT_GT(numbers.back(), 4.0);
}

TEST(NormalRandom, StreamsAndStepsAreUncorrelated) {
  constexpr std::uint64_t kSteps = 100'000;
  const auto correlation = [](std::uint64_t a, std::uint64_t b, std::uint64_t lag) {
    double sum = 0.0;
    for (std::uint64_t step = 0; step < kSteps; ++step) {
      sum += normal_random(1, a, step) * normal_random(1, b, step + lag);
    }
    return sum / static_cast<double>(kSteps);
  };
  const double bound = 4.0 / std::sqrt(static_cast<double>(kSteps));
  EXPECT_LT(std::fabs(correlation(0, 1, 0)), bound);
  EXPECT_LT(std::fabs(correlation(0, 8, 0)), bound);  // the two streams of a pair
  EXPECT_LT(std::fabs(correlation(0, 16, 0)), bound);
  EXPECT_LT(std::fabs(correlation(3, 3, 1)), bound);
}

TEST(NormalRandom, StreamsAndSeedsAreDistinct) {
  std::set<double> seen;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    for (const double number : numbers_of(seed, 40, 5)) seen.insert(number);
  }
  EXPECT_EQ(seen.size(), 20U * 40U * 5U);
}

}  // namespace
}  // namespace merkel
