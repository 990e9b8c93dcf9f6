// Gratings, gaps and edges pressed on the finger without sliding.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>

#include "core/math/line_fit.hpp"
#include "tools/studies/experiments/experiment.hpp"
#include "tools/studies/experiments/pressed_afferents.hpp"
#include "tools/studies/score/parallel_items.hpp"

namespace merkel {
namespace {

constexpr double kGratingDepth_mm = 1.0;
constexpr double kGratingRamp_s = 0.05;
constexpr double kGratingFrom_s = 0.3;
constexpr double kGratingUntil_s = 0.8;
constexpr double kPlate_mm = 14.0;
constexpr double kGroove_mm = 1.5;
constexpr std::size_t kGratingTrials = 8;
constexpr Position kAtApex[] = {{0.0, 0.0}};

enum class BarDirection { kAlong, kAcross };  ///< of the bars, on the finger

/// Presses of a row of bars, moved so that different parts of it lie on the afferent.
struct PressedRow {
  BarTip bars;
  BarDirection direction = BarDirection::kAlong;
  std::vector<double> shifts_mm;
  double depth_mm = kGratingDepth_mm;
  double amplitude_mm = 0.0;  ///< of a sine of 20 Hz on the depth
  std::vector<double> rates_hz;

  std::optional<ParameterError> run(const TactileModel::Parameters& scene) {
    Indenter surface = surface_for_depth(1.1 * (depth_mm + amplitude_mm), kGroove_mm);
    surface.tip = bars;
    surface.orientation_deg = direction == BarDirection::kAlong ? 90.0 : 0.0;
    auto afferents = PressedAfferents::create(scene, surface, kAtApex, kGratingTrials);
    if (!afferents) return afferents.error();
    for (const double shift : shifts_mm) {
      const auto course = [&](double time_s) {
        const double sine =
            time_s > kGratingRamp_s
                ? std::sin(2.0 * std::numbers::pi * 20.0 * (time_s - kGratingRamp_s))
                : 0.0;
        ContactInput at{.depth_mm = depth_mm * std::min(1.0, time_s / kGratingRamp_s) +
                                    amplitude_mm * sine};
        (direction == BarDirection::kAlong ? at.y_mm : at.x_mm) = shift;
        return at;
      };
      rates_hz.push_back(afferents->rates(course, kGratingFrom_s, kGratingUntil_s).front());
    }
    return std::nullopt;
  }

  /// (largest − smallest)/(largest + smallest).
  [[nodiscard]] double modulation() const {
    const auto [least, most] = std::minmax_element(rates_hz.begin(), rates_hz.end());
    return *least + *most > 0.0 ? (*most - *least) / (*most + *least) : 0.0;
  }
  [[nodiscard]] double mean() const {
    return std::accumulate(rates_hz.begin(), rates_hz.end(), 0.0) /
           static_cast<double>(rates_hz.size());
  }
};

std::optional<ParameterError> run_all(std::vector<PressedRow>& rows,
                                      const TactileModel::Parameters& scene, std::size_t threads) {
  return try_each_item(rows.size(), threads,
                       [&](std::size_t /*worker*/, std::size_t i) { return rows[i].run(scene); });
}

/// Ridges as wide as the grooves, one of them in the middle; from a ridge's middle to a groove's.
PressedRow grating(double period_mm, BarDirection direction) {
  const auto half = static_cast<std::size_t>(std::ceil(0.5 * kPlate_mm / period_mm));
  PressedRow row{.bars = {.widths_mm = std::vector<double>(2 * half + 1, 0.5 * period_mm),
                          .gaps_mm = std::vector<double>(2 * half, 0.5 * period_mm),
                          .length_mm = kPlate_mm},
                 .direction = direction};
  for (int k = 0; k <= 3; ++k) row.shifts_mm.push_back(period_mm * k / 6.0);
  return row;
}

}  // namespace

ExperimentOutcome vibrating_gratings(const TactileModel::Parameters& scene, std::size_t threads) {
  const std::vector<double> periods_mm = {1.0, 2.0, 4.0, 8.0};
  enum Condition { kStatic, kDeeper, kVibrating, kHorizontal, kConditions };
  const std::array<const char*, kConditions> names = {
      "bars along the finger, 1 mm", "along, 1.3 mm", "along, 1 mm + 0.2 mm at 20 Hz",
      "bars across the finger, 1 mm"};
  std::vector<PressedRow> rows;
  for (int condition = 0; condition < kConditions; ++condition) {
    for (const double period : periods_mm) {
      PressedRow row =
          grating(period, condition == kHorizontal ? BarDirection::kAcross : BarDirection::kAlong);
      if (condition == kDeeper) row.depth_mm = 1.3;
      if (condition == kVibrating) row.amplitude_mm = 0.2;
      rows.push_back(std::move(row));
    }
  }
  if (const auto error = run_all(rows, scene, threads)) return Unexpected<ParameterError>(*error);

  const std::size_t n = periods_mm.size();
  ExperimentResult result;
  std::array<double, kConditions> modulation{};  // mean of all periods
  std::array<double, kConditions> rate{};
  double least_step = std::numeric_limits<double>::infinity();
  for (std::size_t condition = 0; condition < kConditions; ++condition) {
    ExperimentCurve curve{.series = names[condition],
                          .x_name = "spatial period, mm",
                          .y_name = "spatial modulation of the rate",
                          .x = periods_mm};
    for (std::size_t k = 0; k < n; ++k) {
      const PressedRow& row = rows[condition * n + k];
      curve.model.push_back(row.modulation());
      modulation[condition] += row.modulation() / static_cast<double>(n);
      rate[condition] += row.mean() / static_cast<double>(n);
      if (condition == kStatic && k > 0) {
        least_step = std::min(least_step, curve.model[k] - curve.model[k - 1]);
      }
    }
    result.curves.push_back(std::move(curve));
  }
  constexpr double kMore = std::numeric_limits<double>::infinity();
  result.figures = {
      {"least growth of the modulation from 1 to 2, 2 to 4 and 4 to 8 mm", least_step, "above 0",
       0.0, kMore},
      {"modulation, vibrating / static", modulation[kVibrating] / modulation[kStatic], "1", 0.8,
       1.25},
      {"modulation, 1.3 mm / 1 mm deep", modulation[kDeeper] / modulation[kStatic], "1", 0.8, 1.25},
      {"modulation, bars along / across", modulation[kStatic] / modulation[kHorizontal], "above 1",
       1.0, kMore},
      {"rate, bars along / across", rate[kStatic] / rate[kHorizontal], "above 1", 1.0, kMore}};
  return result;
}

ExperimentOutcome gaps_in_a_plate(const TactileModel::Parameters& scene, std::size_t threads) {
  const std::vector<double> gaps_mm = {0.7, 0.9, 1.1, 1.3};
  PressedRow plate{.bars = {.widths_mm = {kPlate_mm}, .gaps_mm = {}, .length_mm = kPlate_mm},
                   .shifts_mm = {0.0, 0.5 * kPlate_mm}};
  std::vector<PressedRow> rows = {plate};
  for (const double gap : gaps_mm) {
    const double width = 0.5 * (kPlate_mm - gap);
    rows.push_back({.bars = {.widths_mm = {width, width}, .gaps_mm = {gap}, .length_mm = kPlate_mm},
                    .shifts_mm = {0.0, 0.5 * gap}});
  }
  if (const auto error = run_all(rows, scene, threads)) return Unexpected<ParameterError>(*error);

  const double whole = rows[0].rates_hz[0];
  ExperimentCurve dip{.series = "middle of the gap",
                      .x_name = "gap, mm",
                      .y_name = "fall of the rate, part of that under a plate",
                      .x = gaps_mm};
  std::vector<std::pair<double, double>> falls;
  for (std::size_t k = 0; k < gaps_mm.size(); ++k) {
    dip.model.push_back(1.0 - rows[1 + k].rates_hz[0] / whole);
    falls.emplace_back(gaps_mm[k], dip.model[k]);
  }
  const FittedLine line = fit_line(falls);
  // Where the rate rises with the gap, there is no gap from which it falls.
  const double onset = line.slope() > 0.0 ? -line.intercept() / line.slope()
                                          : std::numeric_limits<double>::quiet_NaN();
  if (line.slope() > 0.0) {
    for (const double gap : gaps_mm) dip.recorded.push_back(line.slope() * (gap - 0.55));
  }
  return ExperimentResult{
      .figures = {{"gap from which the response falls, mm", onset, "0.55", 0.35, 0.75},
                  {"edge of a gap of 1.3 mm / plate", rows.back().rates_hz[1] / whole, "above 1",
                   1.0, std::numeric_limits<double>::infinity()}},
      .curves = {dip}};
}

}  // namespace merkel
