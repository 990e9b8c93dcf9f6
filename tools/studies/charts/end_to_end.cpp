// Chart 3: speed against accuracy of the whole chain, from press to spikes.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <fmt/core.h>

#include "core/units.hpp"
#include "tools/filled_text.hpp"
#include "tools/scene/scene_presets.hpp"
#include "tools/studies/bench/measure.hpp"
#include "tools/studies/charts/chart.hpp"
#include "tools/studies/report/spike_train_error.hpp"

namespace merkel {
namespace {

constexpr int kTicks = 1000;

using Depth = double (*)(double time_s);

double constant(double /*time_s*/) { return 1.5; }
double ramp_and_hold(double t) {
  return 1.5 * std::clamp(std::min((t - 0.1) / 0.05, (0.9 - t) / 0.05), 0.0, 1.0);
}
/// Close to the depth at which the pressed afferents begin to fire.
double near_threshold(double t) { return 0.62 + 0.06 * std::sin(2.0 * std::numbers::pi * 7.0 * t); }

struct PressShape {
  const char* name;
  Depth depth_mm;
};
constexpr PressShape kPresses[] = {{"constant 1.5 mm", constant},
                                   {"ramp and hold 1.5 mm", ramp_and_hold},
                                   {"sinusoid near threshold", near_threshold}};

struct Variant {
  std::string name;
  IntegrationMethod method = IntegrationMethod::kCrankNicolson;
  Precision precision = Precision::kDouble;
  double step_us = 25.0;
  double cull_tolerance = 1e-4;
  bool freeze_resting = true;
};

std::vector<Variant> variants() {
  std::vector<Variant> all;
  for (const double step_us : {50.0, 25.0, 12.5}) {
    all.push_back({.name = "crank_nicolson", .step_us = step_us});
    all.push_back(
        {.name = "crank_nicolson float", .precision = Precision::kFloat, .step_us = step_us});
    all.push_back({.name = "exponential_euler",
                   .method = IntegrationMethod::kExponentialEuler,
                   .step_us = step_us});
    all.push_back({.name = "staggered_multistep",
                   .method = IntegrationMethod::kStaggeredMultistep,
                   .step_us = step_us});
    all.push_back({.name = "rk4", .method = IntegrationMethod::kRk4, .step_us = step_us});
  }
  all.push_back(
      {.name = "crank_nicolson, nothing skipped", .cull_tolerance = 0.0, .freeze_resting = false});
  all.push_back({.name = "crank_nicolson, no culling", .cull_tolerance = 0.0});
  all.push_back({.name = "crank_nicolson, no freezing", .freeze_resting = false});
  all.push_back({.name = "crank_nicolson, culled at 1e-3", .cull_tolerance = 1e-3});
  return all;
}

TactileModel model_of(const Variant& variant) {
  TactileModel::Parameters parameters = preset_scene("paper")->model;
  parameters.afferent =
      HodgkinHuxleyAfferent{.method = variant.method, .precision = variant.precision};
  parameters.step = units::nanoseconds_from_us(variant.step_us);
  parameters.accuracy = {.cull_tolerance = variant.cull_tolerance,
                         .freeze_resting = variant.freeze_resting};
  return *TactileModel::create(parameters);
}

std::vector<SpikeEvent> run(TactileModel& model, Depth depth_mm) {
  model.reset();
  std::vector<SpikeEvent> spikes;
  for (int k = 0; k < kTicks; ++k) {
    const auto begin = k * model.parameters().tick;
    const ContactInput input{.depth_mm = depth_mm(units::s_from(begin + model.parameters().tick)),
                             .x_mm = 15.0,
                             .y_mm = 10.0};
    const auto made = model.step({&input, 1}, begin);
    spikes.insert(spikes.end(), made.begin(), made.end());
  }
  return spikes;
}

}  // namespace

Expected<std::string, SetupError> make_end_to_end_chart(const ReportFolder& folder,
                                                        ReportTables& tables) {
  CsvTable& table = tables.at("end_to_end.csv");
  std::string text = filled_page("chart_end_to_end");
  for (const PressShape& press : kPresses) {
    TactileModel exact = model_of({.name = "",
                                   .method = IntegrationMethod::kRk4,
                                   .step_us = 2.5,
                                   .cull_tolerance = 0.0,
                                   .freeze_resting = false});
    const auto reference = run(exact, press.depth_mm);
    text += fmt::format(
        "\n| {}: {} spikes | step (µs) | µs per tick | rms error (ms) | median error (ms) | "
        "without a partner |\n|---|---|---|---|---|---|\n",
        press.name, reference.size());
    for (const Variant& variant : variants()) {
      TactileModel model = model_of(variant);
      std::vector<SpikeEvent> spikes;
      const double cost_us =
          1e6 * measure([&] { spikes = run(model, press.depth_mm); }, 3, 0.01).median_s / kTicks;
      const SpikeTrainError error = spike_train_error(spikes, reference);
      table.row({press.name, variant.name},
                {variant.step_us, cost_us, error.rms_ms, error.median_ms, error.share_unmatched(),
                 static_cast<double>(spikes.size()), static_cast<double>(reference.size())});
      text += fmt::format("| {} | {:g} | {:.2f} | {:.2g} | {:.2g} | {:.1f} % |\n", variant.name,
                          variant.step_us, cost_us, error.rms_ms, error.median_ms,
                          100.0 * error.share_unmatched());
    }
    folder.report((static_cast<double>(&press - kPresses) + 1.0) / std::size(kPresses));
  }
  return text + "\n";
}

}  // namespace merkel
