#include "tools/studies/report/spike_distance.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "core/math/random.hpp"
#include "tools/studies/reference/superposition.hpp"

namespace merkel {
namespace {

using Train = std::vector<double>;

Train random_train(Random& random, std::size_t spikes) {
  Train train(spikes);
  for (double& time : train) time = random.uniform();
  std::sort(train.begin(), train.end());
  return train;
}

/// The least cost over all ordered pairings of spikes, by exhaustive search.
double by_trying(const Train& a, const Train& b, double cost, std::size_t i = 0,
                 std::size_t j = 0) {
  if (i == a.size()) return static_cast<double>(b.size() - j);
  if (j == b.size()) return static_cast<double>(a.size() - i);
  return std::min({1.0 + by_trying(a, b, cost, i + 1, j), 1.0 + by_trying(a, b, cost, i, j + 1),
                   cost * std::fabs(a[i] - b[j]) + by_trying(a, b, cost, i + 1, j + 1)});
}

TEST(SpikeDistance, VictorPurpuraIsTheCheapestWay) {
  Random random(3);
  for (int k = 0; k < 30; ++k) {
    const Train a = random_train(random, 1 + static_cast<std::size_t>(5.0 * random.uniform()));
    const Train b = random_train(random, static_cast<std::size_t>(6.0 * random.uniform()));
    const double cost = random.uniform(0.0, 30.0);
    EXPECT_NEAR(victor_purpura_distance(a, b, cost), by_trying(a, b, cost), 1e-12);
    EXPECT_EQ(victor_purpura_distance(a, a, cost), 0.0);
  }
  EXPECT_EQ(victor_purpura_distance(Train{0.1, 0.2}, Train{}, 100.0), 2.0);
  // Up to 2/cost, moving costs less than removing and adding.
  EXPECT_NEAR(victor_purpura_distance(Train{0.100}, Train{0.104}, 100.0), 0.4, 1e-12);
  EXPECT_EQ(victor_purpura_distance(Train{0.1}, Train{0.2}, 100.0), 2.0);
}

TEST(SpikeDistance, VanRossumIsTheIntegralOfItsDefinition) {
  Random random(5);
  const double tau = 0.05;
  for (int k = 0; k < 5; ++k) {
    const Train a = random_train(random, 3);
    const Train b = random_train(random, 4);
    const auto trace = [tau](const Train& train, double t) {
      double sum = 0.0;
      for (const double spike : train) sum += t >= spike ? std::exp((spike - t) / tau) : 0.0;
      return sum;
    };
    Train corners = a;
    corners.insert(corners.end(), b.begin(), b.end());
    corners.push_back(3.0);
    std::sort(corners.begin(), corners.end());
    double sum = 0.0;
    for (std::size_t i = 0; i + 1 < corners.size(); ++i) {
      if (corners[i + 1] - corners[i] < 1e-12) continue;
      sum += reference::integrate(
          [&](double t) {
            const double difference = trace(a, t) - trace(b, t);
            return difference * difference;
          },
          corners[i], corners[i + 1], 1e-8);
    }
    EXPECT_NEAR(van_rossum_distance(a, b, tau), std::sqrt(sum / tau), 1e-4);
  }
  EXPECT_NEAR(van_rossum_distance(Train{0.1}, Train{}, tau), std::sqrt(0.5), 1e-12);
}

TEST(SpikeDistance, VectorStrengthIsOneForOnePhase) {
  EXPECT_NEAR(vector_strength(Train{0.01, 0.06, 0.11}, 20.0), 1.0, 1e-12);
  EXPECT_NEAR(vector_strength(Train{0.0, 0.025}, 20.0), 0.0, 1e-12);
  EXPECT_TRUE(std::isnan(vector_strength(Train{}, 20.0)));
}

}  // namespace
}  // namespace merkel
