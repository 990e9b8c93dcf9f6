// Blake, Johnson & Hsiao 1997: raised squares and bars that slide across the finger.
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>

#include "tools/studies/experiments/experiment.hpp"
#include "tools/studies/experiments/pressed_afferents.hpp"
#include "tools/studies/score/parallel_items.hpp"

namespace merkel {
namespace {

constexpr double kScanForce_mN = 300.0;
constexpr double kScan_mm_per_s = 20.0;
constexpr double kScanRelief_mm = 0.5;
constexpr double kScanSettle_s = 0.4;
constexpr double kScanLower_s = 0.05;
constexpr double kEdgeReach_mm = 1.5;  ///< an edge evokes impulses this far from it
constexpr double kLargeSquare_mm = 7.0;
constexpr double kScanBar_mm = 5.0;
constexpr double kSmallSquare_mm = 1.0;
constexpr std::size_t kPassTrials = 8;

/// One pass of a pattern along the finger; where its middle is at each impulse, mm from the
/// afferent.
struct ScanPass {
  Indenter pattern;
  double from_mm = 0.0;  ///< to −from_mm
  std::vector<double> at_mm;

  std::optional<ParameterError> run(const TactileModel::Parameters& scene) {
    const Position apex[] = {{0.0, 0.0}};
    auto afferents = PressedAfferents::create(scene, pattern, apex, kPassTrials);
    if (!afferents) return afferents.error();
    const auto middle_mm = [&](double time_s) {
      return from_mm + kScan_mm_per_s * std::max(0.0, time_s - kScanSettle_s);
    };
    const auto course = [&](double time_s) {
      return ContactInput{.force_mN = kScanForce_mN * std::min(1.0, time_s / kScanLower_s),
                          .x_mm = middle_mm(time_s)};
    };
    const auto times = afferents->run(course, kScanSettle_s - 2.0 * from_mm / kScan_mm_per_s);
    for (const double time : times.front()) {
      if (time >= kScanSettle_s) at_mm.push_back(middle_mm(time));
    }
    return std::nullopt;
  }

  /// Rate while the middle is between two places, Hz.
  [[nodiscard]] double rate(double from, double until) const {
    const auto count = static_cast<double>(std::count_if(
        at_mm.begin(), at_mm.end(), [=](double at) { return at >= from && at < until; }));
    return count * kScan_mm_per_s / ((until - from) * kPassTrials);
  }
};

ScanPass rectangle(const TactileModel::Parameters& scene, double width_mm, double length_mm,
                   double orientation_deg) {
  ScanPass pass{.pattern = surface_for_force(scene, kScanForce_mN, kScanRelief_mm)};
  pass.pattern.tip = BarTip{.widths_mm = {width_mm}, .gaps_mm = {}, .length_mm = length_mm};
  pass.pattern.orientation_deg = orientation_deg;
  pass.from_mm = -(0.5 * width_mm + 3.0) / std::cos(orientation_deg * std::numbers::pi / 180.0);
  return pass;
}

/// A small square in the middle of a round hole in a surface of the same height.
ScanPass surrounded(const TactileModel::Parameters& scene, double radius_mm) {
  constexpr double kPixel_mm = 0.1;
  constexpr std::size_t kPixels = 241;
  HeightMap map;
  map.grid = {.pixel_mm = kPixel_mm, .columns = kPixels, .rows = kPixels};
  for (std::size_t j = 0; j < kPixels; ++j) {
    for (std::size_t i = 0; i < kPixels; ++i) {
      const double x = kPixel_mm * (static_cast<double>(i) - 0.5 * (kPixels - 1));
      const double y = kPixel_mm * (static_cast<double>(j) - 0.5 * (kPixels - 1));
      const bool raised = std::hypot(x, y) > radius_mm ||
                          std::max(std::fabs(x), std::fabs(y)) <= 0.5 * kSmallSquare_mm;
      map.height_mm.push_back(raised ? 0.0 : kScanRelief_mm);
      map.coverage.push_back(1.0);
    }
  }
  ScanPass pass{.pattern = surface_for_force(scene, kScanForce_mN, kScanRelief_mm)};
  pass.pattern.tip =
      ShapeTip{.pixel_mm = kPixel_mm, .map = std::make_shared<const HeightMap>(std::move(map))};
  pass.from_mm = -5.0;
  return pass;
}

}  // namespace

ExperimentOutcome scanned_squares(const TactileModel::Parameters& scene, std::size_t threads) {
  const std::vector<double> angles_deg = {90.0, 75.0, 60.0, 45.0, 30.0, 15.0};
  const std::vector<double> radii_mm = {3.0, 4.0, 5.0, 6.0, 7.0};
  std::vector<ScanPass> passes = {rectangle(scene, kLargeSquare_mm, kLargeSquare_mm, 0.0),
                                  rectangle(scene, kSmallSquare_mm, kSmallSquare_mm, 0.0)};
  for (const double angle : angles_deg) {
    passes.push_back(rectangle(scene, kScanBar_mm, 45.0, 90.0 - angle));
  }
  for (const double radius : radii_mm) passes.push_back(surrounded(scene, radius));
  const auto run = [&](std::size_t /*worker*/, std::size_t i) { return passes[i].run(scene); };
  if (const auto error = try_each_item(passes.size(), threads, run)) {
    return Unexpected<ParameterError>(*error);
  }

  const ScanPass& square = passes[0];
  const auto edge = [](const ScanPass& pass, double at_mm, double cosine) {
    return pass.rate((at_mm - kEdgeReach_mm) / cosine, (at_mm + kEdgeReach_mm) / cosine);
  };
  const double rising = edge(square, -0.5 * kLargeSquare_mm, 1.0);
  const double falling = edge(square, 0.5 * kLargeSquare_mm, 1.0);
  ExperimentCurve profile{.series = "square of 7 mm",
                          .x_name = "middle of the square, mm past the afferent",
                          .y_name = "rate, Hz"};
  for (double x = -6.25; x <= 6.25; x += 0.5) {
    profile.x.push_back(x);
    profile.model.push_back(square.rate(x - 0.25, x + 0.25));
  }

  ExperimentCurve sine{.series = "rising edge",
                       .x_name = "sine of the angle between edge and scan",
                       .y_name = "rate at the edge, Hz"};
  double product = 0.0;
  double squares = 0.0;
  for (std::size_t i = 0; i < angles_deg.size(); ++i) {
    const double s = std::sin(angles_deg[i] * std::numbers::pi / 180.0);
    sine.x.push_back(s);
    sine.model.push_back(edge(passes[2 + i], -0.5 * kScanBar_mm, s));
    product += s * sine.model.back();
    squares += s * s;
  }
  double deviation = 0.0;
  for (std::size_t i = 0; i < sine.x.size(); ++i) {
    sine.recorded.push_back(product / squares * sine.x[i]);
    deviation = std::max(deviation, std::fabs(sine.model[i] - sine.recorded[i]));
  }

  const auto small = [&](const ScanPass& pass) { return edge(pass, 0.0, 1.0); };
  const double isolated = small(passes[1]);
  ExperimentCurve surround{.series = "square of 1 mm",
                           .x_name = "radius of the surround, mm",
                           .y_name = "rate, part of that without a surround",
                           .x = radii_mm};
  for (std::size_t i = 0; i < radii_mm.size(); ++i) {
    surround.model.push_back(small(passes[2 + angles_deg.size() + i]) / isolated);
  }
  return ExperimentResult{
      .figures = {{"falling edge / rising edge", falling / rising, "0.5", 0.25, 0.75},
                  {"middle of a square of 7 mm / rising edge", square.rate(-1.0, 1.0) / rising,
                   "edges only", 0.0, 0.2},
                  {"largest deviation from a rate ∝ sine of the edge's angle, part of the rate at "
                   "90°",
                   deviation / sine.model.front(), "0", 0.0, 0.2},
                  {"small square, raised surround at 3 mm / without", surround.model[0], "below 1",
                   0.0, 0.9},
                  {"the same at 5 mm", surround.model[2], "below 1", 0.0, 0.9},
                  {"the same at 7 mm", surround.model[4], "1", 0.9, 1.1}},
      .curves = {profile, sine, surround}};
}

}  // namespace merkel
