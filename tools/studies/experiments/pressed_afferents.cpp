#include "tools/studies/experiments/pressed_afferents.hpp"

#include <chrono>
#include <limits>

#include "core/contact/sphere_law.hpp"
#include "core/units.hpp"
#include "tools/studies/score/trials.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

constexpr Position kApexOfPatch{.x_mm = 15.0, .y_mm = 10.0};
/// A surface is solved at most this often.
constexpr std::chrono::milliseconds kSurfaceTick{1};
constexpr double kContactRoom = 1.15;  ///< for the contact of a surface

}  // namespace

Expected<PressedAfferents, ParameterError> PressedAfferents::create(
    const TactileModel::Parameters& scene, const Indenter& indenter,
    std::span<const Position> places, std::size_t trials) {
  Stimulus stimulus;
  stimulus.indenter = indenter;
  TactileModel::Parameters parameters = repeated_afferent(scene, stimulus, places.size() * trials);
  std::vector<FieldCentre>& centres = parameters.patches.front().centres;
  for (std::size_t i = 0; i < centres.size(); ++i) {
    const Position& place = places[i / trials];
    centres[i] = {.x_mm = kApexOfPatch.x_mm + place.x_mm, .y_mm = kApexOfPatch.y_mm + place.y_mm};
  }
  if (indenter.surface.slides) parameters.tick = kSurfaceTick;
  auto model = TactileModel::create(parameters);
  if (!model) return Unexpected<ParameterError>(model.error());
  return PressedAfferents(std::move(*model), trials);
}

std::vector<std::vector<double>> PressedAfferents::run(const Course& course, double seconds) {
  model_.reset();
  std::vector<std::vector<double>> times(model_.neurons() / trials_);
  const nanoseconds tick = model_.parameters().tick;
  const nanoseconds end = units::nanoseconds_from_s(seconds);
  ContactInput contacts[1];
  for (nanoseconds time{0}; time < end; time += tick) {
    contacts[0] = course(units::s_from(time + tick));
    contacts[0].x_mm += kApexOfPatch.x_mm;
    contacts[0].y_mm += kApexOfPatch.y_mm;
    for (const SpikeEvent& spike : model_.step(contacts, time)) {
      times[(spike.neuron - 1) / trials_].push_back(units::s_from(spike.time));
    }
  }
  return times;
}

std::vector<double> PressedAfferents::rates(const Course& course, double from_s, double until_s) {
  std::vector<double> rates;
  for (const std::vector<double>& times : run(course, until_s)) {
    double count = 0.0;
    for (const double time : times) count += time >= from_s && time < until_s ? 1.0 : 0.0;
    rates.push_back(count / (static_cast<double>(trials_) * (until_s - from_s)));
  }
  return rates;
}

Indenter surface_for_force(const TactileModel::Parameters& scene, double force_mN,
                           double relief_mm) {
  const SphereLaw plate(scene.skin, std::numeric_limits<double>::infinity());
  Indenter indenter =
      surface_for_depth(kContactRoom * plate.at_force(force_mN).depth_mm + relief_mm, relief_mm);
  indenter.control = Indenter::Control::kForce;
  return indenter;
}

Indenter surface_for_depth(double depth_mm, double relief_mm) {
  Indenter indenter;
  indenter.surface.slides = true;
  indenter.surface.relief_mm = relief_mm;
  indenter.surface.deepest_mm = depth_mm;
  return indenter;
}

}  // namespace merkel
