#include <cstdio>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/neurons/hodgkin_huxley/hodgkin_huxley_group.hpp"
#include "core/parameters/nearest_name.hpp"
#include "core/units.hpp"
#include "drivers/files/csv_text.hpp"
#include "tools/commands/command.hpp"
#include "tools/commands/inspect.hpp"
#include "tools/print_text.hpp"

namespace merkel {
namespace {

/// Sets a value of [neuron] by its key, as in "g_CaL=0"; underscores are optional.
Expected<void, SetupError> apply_setting(const std::string& setting, HodgkinHuxley& neuron) {
  const auto bare = [](std::string name) {
    std::erase(name, '_');
    return name;
  };
  const auto equals = setting.find('=');
  const std::string name = bare(setting.substr(0, equals));
  const auto value =
      equals == std::string::npos ? std::nullopt : parse_number(setting.substr(equals + 1));
  std::string known;
  for (const BoundField& key : bind_fields(neuron)) {
    known.append(known.empty() ? "" : ", ").append(key.field->key);
    if (!value || name != bare(std::string(key.field->key))) continue;
    *std::get<double*>(key.value) = *value;
    return {};
  }
  return bad_input("--set " + setting +
                   " is not valid: write NAME=NUMBER, as in g_CaL=0, with NAME one of " + known);
}

/// The injected current at a time: constant, or a ramp up from t0 to t1 and down from t2 to t3.
double injected(const InspectOptions& options, double time_ms) {
  if (options.current) return *options.current;
  const double t0 = options.ramp[0];
  const double t1 = options.ramp[1];
  const double t2 = options.ramp[2];
  const double t3 = options.ramp[3];
  const double peak = options.ramp[4];
  if (time_ms < t0 || time_ms >= t3) return 0.0;
  if (time_ms < t1) return peak * (time_ms - t0) / (t1 - t0);
  if (time_ms <= t2) return peak;
  return peak * (t3 - time_ms) / (t3 - t2);
}

}  // namespace

int inspect_neuron(const InspectOptions& options) {
  auto scene = scene_of(options);
  if (!scene) return refuse(scene.error());
  const auto* const paper = std::get_if<HodgkinHuxleyAfferent>(&scene->model.afferent);
  HodgkinHuxley neuron = paper != nullptr ? paper->neuron : HodgkinHuxley{};
  for (const std::string& setting : options.settings) {
    if (auto set = apply_setting(setting, neuron); !set) return refuse(set.error());
  }
  const auto method = integration_method_named(options.method);
  const std::chrono::nanoseconds step = units::nanoseconds_from_us(options.step_us);
  const bool ordered = options.ramp.empty() ||
                       (options.ramp[0] <= options.ramp[1] && options.ramp[1] <= options.ramp[2] &&
                        options.ramp[2] <= options.ramp[3]);
  const auto checked =
      ParameterCheck()
          .also(neuron.check())
          .require(method.has_value(), "--method",
                   "must be one of " + listed(integration_method_names()))
          .require(step.count() > 0, "--step-us", "must be at least 0.001")
          .require(options.current.has_value() == options.ramp.empty(), "--current",
                   "or --ramp must be given, but not both")
          .require(ordered, "--ramp", "must have its times in order: t0,t1,t2,t3,I")
          .result();
  if (!checked) {
    return refuse(checked.error().key + " " + checked.error().reason);
  }

  HodgkinHuxleyGroup population(
      {.neuron = neuron, .method = *method, .step = step, .freeze_resting = false}, 1,
      std::nullopt);
  SpikeBuffer spikes(2);
  std::printf("spike,time_ms\n");
  std::uint64_t number = 0;
  std::uint64_t resets = 0;
  const auto end = units::nanoseconds_from_ms(options.duration_ms);
  for (std::chrono::nanoseconds time{0}; time < end; time += step) {
    const double begin_current = injected(options, units::ms_from(time));
    const double end_current = injected(options, units::ms_from(time + step));
    spikes.clear();
    population.advance({&begin_current, 1}, {&end_current, 1}, 1, time, spikes);
    resets += population.resets().size();
    for (const SpikeEvent& spike : std::as_const(spikes).events()) {
      print_text(stdout, "{},{:.6f}\n", ++number, units::ms_from(spike.time));
    }
  }
  if (resets > 0) {
    return fail("the membrane's state became non-finite " + std::to_string(resets) +
                " times: reduce --step-us");
  }
  return kDone;
}

}  // namespace merkel
