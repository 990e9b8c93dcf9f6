#include "tools/run/silence.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/core.h>

#include "core/scene/tactile_patch.hpp"
#include "core/units.hpp"
#include "drivers/sample_limits.hpp"
#include "tools/scene/scene_presets.hpp"

namespace merkel {
namespace {

constexpr std::chrono::nanoseconds kMaxDuration{500'000'000};  ///< of the rise, and of the hold

/// Presses of one probe on its patch alone, of any depth or force, with the rise and the hold of a
/// press that was seen.
class SamePress {
 public:
  static std::optional<SamePress> create(TactileModel::Parameters parameters, std::size_t probe,
                                         const Press& place, const DeepestPress& seen) {
    Indenter indenter = parameters.indenters[probe];
    parameters.patches = {parameters.patches[indenter.patch]};
    indenter.patch = 0;
    parameters.indenters = {indenter};
    auto model = TactileModel::create(parameters);
    if (!model) return std::nullopt;
    return SamePress(std::move(*model), place, seen);
  }

  struct Outcome {
    bool fired = false;
    double strongest_drive = 0.0;  ///< at the end: current or mean energy density
  };
  /// \param level  mm or mN, as the probe is controlled
  Outcome press(double level) {
    model_.reset();
    Outcome outcome;
    const auto tick = model_.parameters().tick;
    for (std::chrono::nanoseconds time{0}; time < rise_ + hold_; time += tick) {
      const double part = std::min(1.0, units::s_from(time + tick) / units::s_from(rise_));
      const double value = level * part;
      const ContactInput input{.depth_mm = force() ? 0.0 : value,
                               .force_mN = force() ? value : 0.0,
                               .x_mm = x_mm_,
                               .y_mm = y_mm_};
      outcome.fired = !model_.step({&input, 1}, time).empty() || outcome.fired;
    }
    const auto drives = model_.patches().front().drive().output();
    outcome.strongest_drive = *std::max_element(drives.begin(), drives.end());
    return outcome;
  }

  /// The smallest level at which an afferent fires, rounded up to a twentieth of its decade; empty
  /// if none fires up to `most`.
  std::optional<double> threshold(double low, double most) {
    double high = std::max(2.0 * low, 1e-3);
    while (!press(std::min(high, most)).fired) {
      if (high >= most) return std::nullopt;
      low = high;
      high *= 2.0;
    }
    high = std::min(high, most);
    while (high - low > 0.01 * high) {
      const double middle = 0.5 * (low + high);
      (press(middle).fired ? high : low) = middle;
    }
    const double step = 0.05 * std::pow(10.0, std::floor(std::log10(high)));
    return std::ceil(high / step) * step;
  }

  [[nodiscard]] bool force() const {
    return model_.parameters().indenters.front().control == Indenter::Control::kForce;
  }

 private:
  SamePress(TactileModel model, const Press& place, const DeepestPress& seen)
      : model_(std::move(model)),
        x_mm_(place.x_mm),
        y_mm_(place.y_mm),
        rise_(std::max(std::min(seen.rise, kMaxDuration), model_.parameters().tick)),
        hold_(std::max(std::min(seen.touch - seen.rise, kMaxDuration), model_.parameters().tick)) {}

  TactileModel model_;
  double x_mm_;
  double y_mm_;
  std::chrono::nanoseconds rise_;
  std::chrono::nanoseconds hold_;
};

std::string decimal(double value) { return fmt::format("{:.3g}", value); }

/// The probe that pressed hardest; empty if none touched.
std::optional<std::size_t> hardest(const TactileModel& model) {
  std::optional<std::size_t> found;
  for (std::size_t i = 0; i < model.indenters(); ++i) {
    const Press& press = model.deepest()[i];
    if (!press.touching()) continue;
    if (!found || press.contact.force_mN > model.deepest()[*found].contact.force_mN) found = i;
  }
  return found;
}

/// Whether the afferents of the preset goodwin fire under the same press.
bool goodwin_fires(const TactileModel& model, std::size_t probe, const DeepestPress& seen,
                   double level) {
  TactileModel::Parameters goodwin = preset_scene("goodwin")->model;
  goodwin.indenters = {model.parameters().indenters[probe]};
  goodwin.indenters.front().patch = 0;
  auto press = SamePress::create(std::move(goodwin), 0, model.deepest()[probe], seen);
  return press && press->press(level).fired;
}

}  // namespace

std::string silence_text(const RunReport& report, const TactileModel& model) {
  if (report.spikes > 0) return {};
  const auto probe = hardest(model);
  if (!probe) return "no afferent fired: no probe touched the skin";
  const Press& deepest = model.deepest()[*probe];
  std::string text = "no afferent fired: the press reached " +
                     decimal(units::N_from_mN(deepest.contact.force_mN)) + " N (" +
                     decimal(deepest.contact.depth_mm) + " mm)";
  if (model.parameters().indenters[*probe].taxels() != nullptr) {
    return "no afferent fired: the taxels reached " + decimal(deepest.contact.peak_pressure_kPa) +
           " kPa and " + decimal(units::N_from_mN(deepest.contact.force_mN)) +
           " N: check the unit of their channels, or press harder";
  }
  const DeepestPress& seen = report.probes[*probe].deepest_press;
  auto press = SamePress::create(model.parameters(), *probe, deepest, seen);
  if (!press) return text;
  const bool force = press->force();
  const double level = force ? deepest.contact.force_mN : deepest.contact.depth_mm;
  const auto threshold = press->threshold(
      level, force ? SampleLimits::kForce_mN : std::min(20.0, SampleLimits::kDepth_mm));
  std::string advice;
  if (threshold) {
    const double got = press->press(level).strongest_drive;
    const double needed = press->press(*threshold).strongest_drive;
    if (got < needed) {
      text += "; the strongest afferent reached " + decimal(100.0 * got / needed) +
              " % of its rheobase";
    }
    advice = force ? "press harder than about " + decimal(units::N_from_mN(*threshold)) + " N"
                   : "press deeper than about " + decimal(*threshold) + " mm";
    if (seen.rise < kMaxDuration) {
      advice += ", with the same rise time (" + decimal(units::ms_from(seen.rise)) + " ms)";
    }
  }
  if (!model.parameters().energy_driven() && goodwin_fires(model, *probe, seen, level)) {
    advice += std::string(advice.empty() ? "" : " or ") + "try merkel run goodwin --probe '" +
              report.probes[*probe].uri + "'";
  }
  if (advice.empty()) {
    return text + ": no press of this tip can make an afferent of this scene fire";
  }
  advice.front() = static_cast<char>(advice.front() - 'a' + 'A');
  return text + ". " + advice;
}

}  // namespace merkel
