#include "tools/studies/score/pin_array.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "core/contact/pressed_tip.hpp"
#include "core/contact/solver/tip_heights.hpp"
#include "core/scene/tactile_patch.hpp"
#include "core/skin/strain_energy_density.hpp"
#include "core/units.hpp"
#include "tools/studies/score/trials.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

constexpr double kRamp_s = 0.05;
constexpr double kSettle_s = 2.0;  ///< from the first touch to the increment
constexpr double kCount_s = 1.0;

/// The points of a hexagonal lattice nearest to the origin, by distance, and by angle where that is
/// the same.
std::vector<Position> lattice(std::size_t count, double spacing_mm) {
  struct Point {
    int distance2;  ///< in units of the spacing
    double angle;
    Position at;
  };
  std::vector<Point> points;
  constexpr int kRings = 16;
  for (int a = -kRings; a <= kRings; ++a) {
    for (int b = -kRings; b <= kRings; ++b) {
      const Position at{.x_mm = spacing_mm * (a + 0.5 * b),
                        .y_mm = spacing_mm * 0.5 * std::numbers::sqrt3 * b};
      points.push_back({a * a + a * b + b * b, std::atan2(at.y_mm, at.x_mm), at});
    }
  }
  std::sort(points.begin(), points.end(), [](const Point& first, const Point& second) {
    return std::pair(first.distance2, first.angle) < std::pair(second.distance2, second.angle);
  });
  std::vector<Position> nearest;
  for (std::size_t i = 0; i < count; ++i) nearest.push_back(points[i].at);
  return nearest;
}

TipField solve(const SkinParameters& skin, const PinArray& array,
               const PinArrayTrials::Increment& increment) {
  const std::vector<Position> pins = lattice(array.pins, array.spacing_mm);
  const double half_mm = std::hypot(pins.back().x_mm, pins.back().y_mm) + 0.5 * array.diameter_mm;
  TipHeight tip = [=](double x, double y) {
    // Called so often that std::hypot would take half of the time of `merkel score`.
    for (std::size_t i = 0; i < pins.size(); ++i) {
      const double dx = x - pins[i].x_mm;
      const double dy = y - pins[i].y_mm;
      if (dx * dx + dy * dy <= 0.25 * array.diameter_mm * array.diameter_mm) {
        return i < increment.pins ? 0.0 : increment.depth_mm;
      }
    }
    return std::numeric_limits<double>::infinity();
  };
  // A pixel per eighth of a pin: the pins' rims are covered in part.
  const PressedTip pressed{
      .gap = above_finger(std::move(tip), skin.finger_along_mm(), skin.radius_mm, {}),
      .half_width_mm = half_mm,
      .half_length_mm = half_mm,
      .feature_mm = 1.5 * array.diameter_mm};
  return {pressed, skin, array.background_mm + (increment.pins > 0 ? increment.depth_mm : 0.0)};
}

}  // namespace

Expected<PinArrayTrials, ParameterError> PinArrayTrials::create(
    const TactileModel::Parameters& scene, const PinArray& array, std::size_t trials) {
  auto model = TactileModel::create(repeated_afferent(scene, Stimulus{}, trials));
  if (!model) return Unexpected<ParameterError>(model.error());
  auto afferents =
      Afferents::create(model->parameters(), 0, trials, afferent_tables_of(model->parameters()));
  if (!afferents) return Unexpected<ParameterError>(afferents.error());
  return PinArrayTrials(*model, array, std::move(*afferents));
}

PinArrayTrials::PinArrayTrials(const TactileModel& model, const PinArray& array,
                               Afferents afferents)
    : scene_(model.parameters()),
      array_(array),
      afferents_(std::move(afferents)),
      background_(solve(scene_.skin, array, {.pins = 0, .depth_mm = 0.0})) {
  const TactilePatch& patch = model.patches().front();
  for (Receptor receptor : patch.drive().receptors()) {
    if (receptor.neuron != 1) continue;
    receptor.x_mm -= patch.sites().front().x_mm;
    receptor.y_mm -= patch.sites().front().y_mm;
    receptors_.push_back(receptor);
  }
}

TipField PinArrayTrials::field(const Increment& increment) const {
  return solve(scene_.skin, array_, increment);
}

double PinArrayTrials::input(const TipField& increment, double part, double x_mm,
                             double y_mm) const {
  const SkinParameters& skin = scene_.skin;
  const SkinMaterial material(skin);
  const double last_mm = increment.deepest_mm();
  // A few pins more do not stiffen all of the skin.
  const double stiffening =
      skin.stiffening_at(array_.background_mm, background_.mean_pressure_kPa(array_.background_mm));
  double sum = 0.0;
  for (const Receptor& receptor : receptors_) {
    const double x = x_mm + receptor.x_mm;
    const double y = y_mm + receptor.y_mm;
    CartesianStress stress = background_.at(x, y, array_.background_mm).stress * (1.0 - part);
    stress += increment.at(x, y, last_mm).stress * part;
    const double energy = stiffening * energy_density_kPa(stress, material, skin.energy_density);
    sum += scene_.energy_driven() ? energy / static_cast<double>(receptors_.size())
                                  : scene_.transduction.current_uA_per_cm2(energy);
  }
  return sum;
}

double PinArrayTrials::impulses(const double (&inputs)[3]) {
  const std::size_t trials = afferents_.neurons().size();
  const nanoseconds tick = scene_.tick;
  const int steps = static_cast<int>(tick / scene_.step);
  const auto at = [&](double time_s) {
    const double lowered = std::min(1.0, time_s / kRamp_s);
    const double part = std::clamp((time_s - kSettle_s) / kRamp_s, 0.0, 1.0);
    // Through the three inputs: the energy density is quadratic in the stress.
    return lowered * lowered *
           ((1.0 - part) * (1.0 - 2.0 * part) * inputs[0] + 4.0 * part * (1.0 - part) * inputs[1] +
            part * (2.0 * part - 1.0) * inputs[2]);
  };
  afferents_.reset();
  SpikeBuffer spikes(trials * 12);
  std::vector<double> begin(trials);
  std::vector<double> end(trials);
  std::size_t count = 0;
  const nanoseconds last = units::nanoseconds_from_s(kSettle_s + kCount_s);
  for (nanoseconds time{0}; time < last; time += tick) {
    std::swap(begin, end);
    std::fill(end.begin(), end.end(), at(units::s_from(time + tick)));
    spikes.clear();
    afferents_.advance(begin, end, steps, time, spikes, nullptr);
    if (units::s_from(time) >= kSettle_s) count += spikes.events().size();
  }
  return static_cast<double>(count) / static_cast<double>(trials);
}

double PinArrayTrials::response(const TipField& increment, double x_mm, double y_mm) {
  const double background = input(increment, 0.0, x_mm, y_mm);
  return impulses(
             {background, input(increment, 0.5, x_mm, y_mm), input(increment, 1.0, x_mm, y_mm)}) -
         impulses({background, background, background});
}

}  // namespace merkel
