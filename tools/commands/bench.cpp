#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/parameters/nearest_name.hpp"
#include "core/simd/simd_target.hpp"
#include "core/units.hpp"
#include "realtime/threads/spinning_team.hpp"
#include "tools/commands/command.hpp"
#include "tools/filled_text.hpp"
#include "tools/json_text.hpp"
#include "tools/number_text.hpp"
#include "tools/print_text.hpp"
#include "tools/scene/scene_presets.hpp"
#include "tools/studies/bench/fma_peak.hpp"
#include "tools/studies/bench/population_cost.hpp"
#include "tools/studies/bench/tick_cost.hpp"

namespace merkel {
namespace {

struct BenchOptions {
  bool json = false;
  bool set_up = false;
  std::string target;
  std::optional<double> neurons;  ///< empty: several sizes, and the ticks
  std::string method = std::string(name_of(IntegrationMethod::kCrankNicolson));
  double step_us = 25.0;
};

struct Row {
  PopulationCase which;
  int threads = 1;
  double ns = 0.0;  ///< per neuron-step
  [[nodiscard]] double times_real_time() const {
    return which.step_us * 1e3 / (ns * static_cast<double>(which.neurons));
  }
  [[nodiscard]] double gflops() const { return operations_of_neuron_step(which.precision) / ns; }
  /// True if operations_of_neuron_step() and port_bound_s() apply.
  [[nodiscard]] bool counted() const {
    return which.method == IntegrationMethod::kCrankNicolson &&
           1e-3 * which.step_us < kExponentialGates_ms;
  }
};

Row row_of(const PopulationCase& which) {
  return {.which = which,
          .threads = which.team == nullptr ? 1 : which.team->size(),
          .ns = 1e9 * neuron_step_cost(which).median_s};
}

/// A press of 1.5 mm at the centre of a probe's patch.
ContactInput centre_press(const TactileModel::Parameters& model, std::size_t probe) {
  const Patch& patch = model.patches[model.indenters[probe].patch].patch;
  return {.depth_mm = 1.5, .x_mm = 0.5 * patch.length_mm, .y_mm = 0.5 * patch.width_mm};
}

/// The cost of a tick of the default scene, µs, at its own tick and at 50 µs.
struct DefaultCost {
  double tick_ms = 0.0;
  double tick = 0.0;
  StageCosts stages;
  double short_tick = 0.0;
};
constexpr std::chrono::microseconds kShortTick{50};

DefaultCost default_cost() {
  TactileModel::Parameters model = preset_scene("paper")->model;
  const ContactInput press = centre_press(model, 0);
  DefaultCost cost{.tick_ms = units::ms_from(model.tick),
                   .tick = 1e6 * tick_cost(model, {&press, 1})->median_s,
                   .stages = *stage_costs(model, press)};
  model.tick = kShortTick;
  cost.short_tick = 1e6 * tick_cost(model, {&press, 1})->median_s;
  return cost;
}

/// The time to build the model of each preset, ms: the median of three.
std::vector<std::pair<std::string, double>> set_up_times() {
  std::vector<std::pair<std::string, double>> times;
  for (const std::string& name : preset_names()) {
    const TactileModel::Parameters model = preset_scene(name)->model;
    std::array<double, 3> runs_ms{};
    for (double& run_ms : runs_ms) {
      const auto begin = std::chrono::steady_clock::now();
      static_cast<void>(TactileModel::create(model));
      run_ms = units::ms_from(std::chrono::steady_clock::now() - begin);
    }
    std::sort(runs_ms.begin(), runs_ms.end());
    times.emplace_back(name, runs_ms[1]);
  }
  return times;
}

int bench_set_up(bool json) {
  const auto times = set_up_times();
  if (json) {
    Json all;
    for (const auto& [name, ms] : times) all["set_up_ms"][name] = ms;
    std::fputs(json_text(all).c_str(), stdout);
    return kDone;
  }
  for (const auto& [name, ms] : times) {
    print_text(stdout, "preset {}: set-up {} ms\n", name, number_text(ms));
  }
  return kDone;
}

/// The cost of a tick of the whole hand, µs.
struct HandCost {
  double fingertip_alone = 0.0;  ///< a scene with the thumb alone
  double thumb = 0.0;            ///< only the thumb pressed
  double all = 0.0;              ///< all pads pressed, on one thread
  double shared = 0.0;           ///< all pads pressed, on two threads; 0 on a single core
};
HandCost hand_cost(WorkerTeam* team) {
  const TactileModel::Parameters hand = preset_scene("hand")->model;
  TactileModel::Parameters thumb = hand;
  thumb.patches.resize(1);
  thumb.indenters.resize(1);
  std::vector<ContactInput> presses(hand.indenters.size());
  presses[0] = centre_press(hand, 0);
  HandCost cost;
  cost.fingertip_alone = 1e6 * tick_cost(thumb, {presses.data(), 1})->median_s;
  cost.thumb = 1e6 * tick_cost(hand, presses)->median_s;
  for (std::size_t i = 0; i < presses.size(); ++i) presses[i] = centre_press(hand, i);
  cost.all = 1e6 * tick_cost(hand, presses)->median_s;
  if (team != nullptr) cost.shared = 1e6 * tick_cost(hand, presses, team)->median_s;
  return cost;
}

/// The measurements: populations, and ticks unless the user selected one population size.
struct BenchResult {
  std::string target;
  double peak[2] = {0.0, 0.0};  ///< GFLOP/s per core: double, float
  std::vector<Row> rows;
  std::optional<DefaultCost> scene;
  HandCost hand;

  [[nodiscard]] double peak_of(Precision p) const { return peak[p == Precision::kDouble ? 0 : 1]; }
  [[nodiscard]] double of_peak(const Row& row) const {
    return row.gflops() / (row.threads * peak_of(row.which.precision));
  }
  [[nodiscard]] double of_bound(const Row& row) const {
    const Precision precision = row.which.precision;
    return 1e9 * port_bound_s(precision, peak_of(precision)) / (row.threads * row.ns);
  }
};

std::vector<Row> measured_rows(const BenchOptions& options, IntegrationMethod method,
                               WorkerTeam* two) {
  std::vector<std::size_t> sizes = {20, 450, 2000, 17'000};
  if (options.neurons) sizes = {static_cast<std::size_t>(*options.neurons)};
  std::vector<Row> rows;
  for (const bool coupled : {false, true}) {
    for (const std::size_t neurons : sizes) {
      for (const auto precision : {Precision::kDouble, Precision::kFloat}) {
        const PopulationCase which{.neurons = neurons,
                                   .method = method,
                                   .precision = precision,
                                   .step_us = options.step_us,
                                   .coupled = coupled};
        rows.push_back(row_of(which));
        if (neurons < 17'000 || two == nullptr) continue;
        PopulationCase shared = which;
        shared.team = two;
        rows.push_back(row_of(shared));
      }
    }
  }
  return rows;
}

Json json_of(const BenchOptions& options, const BenchResult& result) {
  Json populations = Json::array();
  for (const Row& row : result.rows) {
    Json entry = {{"neurons", row.which.neurons},
                  {"coupled", row.which.coupled},
                  {"precision", name_of(row.which.precision)},
                  {"threads", row.threads},
                  {"ns_per_neuron_step", row.ns},
                  {"ns_per_step", row.ns * static_cast<double>(row.which.neurons)},
                  {"times_real_time", row.times_real_time()}};
    if (row.counted()) {
      entry["gflops"] = row.gflops();
      entry["fraction_of_peak"] = result.of_peak(row);
      entry["fraction_of_port_bound"] = result.of_bound(row);
    }
    populations.push_back(std::move(entry));
  }
  Json all = {{"simd_target", result.target},
              {"fma_peak_gflops", {{"double", result.peak[0]}, {"float", result.peak[1]}}},
              {"method", options.method},
              {"step_us", options.step_us},
              {"populations", std::move(populations)}};
  if (result.scene) {
    const DefaultCost& scene = *result.scene;
    const HandCost& hand = result.hand;
    all["default_scene_tick_us"] = scene.tick;
    all["default_scene_times_real_time"] = 1e3 * scene.tick_ms / scene.tick;
    all["default_scene_stages_us"] = {{"contact", scene.stages.contact},
                                      {"drive", scene.stages.drive},
                                      {"neurons", scene.stages.neurons},
                                      {"publish", scene.stages.publish}};
    all["default_scene_50us_tick_us"] = scene.short_tick;
    all["hand_tick_us"] = {{"fingertip_alone", hand.fingertip_alone},
                           {"one_fingertip_pressed", hand.thumb},
                           {"all_pressed", hand.all},
                           {"all_pressed_two_threads", hand.shared}};
  }
  return all;
}

std::string text_of(Json facts, const BenchResult& result) {
  for (Json& each : facts["populations"]) {
    if (!each.contains("gflops")) continue;
    each["peak_percent"] = 100.0 * each["fraction_of_peak"].get<double>();
    each["bound_percent"] = 100.0 * each["fraction_of_port_bound"].get<double>();
  }
  if (result.scene) {
    facts["tick_ms"] = result.scene->tick_ms;
    facts["short_times_real_time"] = units::ms_from(kShortTick) * 1e3 / result.scene->short_tick;
    facts["pressed_to_alone"] = result.hand.thumb / result.hand.fingertip_alone;
  }
  return filled_text("bench", facts);
}

int bench(const BenchOptions& options) {
  if (options.set_up) return bench_set_up(options.json);
  if (auto forced = force_simd_target(options.target); !forced) return refuse(forced.error());
  const auto method = integration_method_named(options.method);
  if (!method) {
    return refuse("--method must be one of " + listed(integration_method_names()) + ", but is \"" +
                  options.method + "\"");
  }
  const auto team = SpinningTeam::create(std::min(2, SpinningTeam::available_cores()));
  WorkerTeam* const two = team && (*team)->size() > 1 ? team->get() : nullptr;
  BenchResult result{
      .target = options.target.empty() ? simd_target() : options.target,
      .peak = {fma_peak_gflops(Precision::kDouble), fma_peak_gflops(Precision::kFloat)},
      .rows = measured_rows(options, *method, two)};
  if (!options.neurons) {
    result.scene = default_cost();
    result.hand = hand_cost(two);
  }
  const Json facts = json_of(options, result);
  std::fputs((options.json ? json_text(facts) : text_of(facts, result)).c_str(), stdout);
  return kDone;
}

}  // namespace

void add_bench_command(CommandLine& program) {
  auto options = std::make_shared<BenchOptions>();
  program
      .subcommand("bench",
                  "Measures this machine: the time of one membrane step per neuron for networks of "
                  "several sizes, and the time of a tick of the default scene.",
                  "bench --json")
      .option("--target", options->target,
              "Instruction set to use instead of the best: avx512, avx2, neon, scalar")
      .option("--neurons", options->neurons,
              "Measure only populations of this size; default: 20 to 17000, and ticks", {1.0, 1e6})
      .option("--method", options->method, "Integration method of the populations")
      .option("--step-us", options->step_us, "Step of the populations, µs", {0.1, 1000.0})
      .flag("--set-up", options->set_up, "Measure only the set-up of every preset")
      .flag("--json", options->json, "Print the results as JSON")
      .runs([options] { return bench(*options); });
}

}  // namespace merkel
