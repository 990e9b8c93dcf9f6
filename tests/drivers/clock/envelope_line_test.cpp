#include "drivers/clock/envelope_line.hpp"

#include <vector>

#include <gtest/gtest.h>

namespace merkel {
namespace {

constexpr double kSecond_ns = 1e9;

std::vector<EnvelopePoint> clock_points(int count, double slope, double offset_ns) {
  std::vector<EnvelopePoint> points;
  for (int k = 0; k < count; ++k) {
    const double x = (k - count + 1) * kSecond_ns;
    points.push_back({.x_ns = x, .y_ns = offset_ns + slope * x});
  }
  return points;
}

TEST(EnvelopeLine, APerfectClockIsItsOwnEnvelope) {
  const EnvelopeLine line = fit_envelope(clock_points(30, -50e-6, 700.0), 0.0);
  EXPECT_NEAR(line.slope, -50e-6, 1e-12);
  EXPECT_NEAR(line.intercept_ns, 700.0, 1e-3);
  EXPECT_NEAR(line.rms_ns, 0.0, 1e-3);
}

TEST(EnvelopeLine, AThirdOfThePointsDelayedHasNoEffect) {
  for (const int first : {0, 7, 20}) {
    auto points = clock_points(30, 80e-6, 0.0);
    for (int k = first; k < first + 10; ++k) {
      points[static_cast<std::size_t>(k)].y_ns += (0.2 + 0.03 * k) * kSecond_ns;
    }
    const EnvelopeLine line = fit_envelope(points, 0.0);
    EXPECT_NEAR(line.slope, 80e-6, 1e-9) << first;
    EXPECT_NEAR(line.intercept_ns, 0.0, 1e-2) << first;
  }
}

TEST(EnvelopeLine, AnImpossibleSlopeIsRejected) {
  // The end of a stall: the least delay falls by one second per second.
  auto points = clock_points(12, -1.0, 0.0);
  const EnvelopeLine line = fit_envelope(points, 30e-6);
  EXPECT_LT(line.slope, 0.02);
  EXPECT_GT(line.slope, -0.02);
  EXPECT_NEAR(line.intercept_ns, 0.0, kSecond_ns);  // the last one is the least delayed
}

TEST(EnvelopeLine, OnePointKeepsTheSlope) {
  const EnvelopeLine line = fit_envelope(clock_points(1, 0.0, 250.0), 12e-6);
  EXPECT_EQ(line.slope, 12e-6);
  EXPECT_EQ(line.intercept_ns, 250.0);
}

}  // namespace
}  // namespace merkel
