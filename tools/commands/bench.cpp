#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/simd/simd_target.hpp"
#include "core/units.hpp"
#include "realtime/threads/spinning_team.hpp"
#include "tools/commands/command.hpp"
#include "tools/scene/scene_presets.hpp"
#include "tools/studies/bench/fma_peak.hpp"
#include "tools/studies/bench/population_cost.hpp"
#include "tools/studies/bench/tick_cost.hpp"

namespace merkel {
namespace {

struct BenchOptions {
  bool json = false;
  std::string target;
};

struct Row {
  PopulationCase which;
  int threads = 1;
  double ns = 0.0;  ///< a neuron-step
  [[nodiscard]] double times_real_time() const {
    return which.step_us * 1e3 / (ns * static_cast<double>(which.neurons));
  }
  [[nodiscard]] double gflops() const { return operations_of_neuron_step(which.precision) / ns; }
};

Row row_of(const PopulationCase& which) {
  return {.which = which,
          .threads = which.team == nullptr ? 1 : which.team->size(),
          .ns = 1e9 * neuron_step_cost(which).median_s};
}

/// 1.5 mm deep at the centre of a probe's patch.
ContactInput centre_press(const TactileModel::Parameters& model, std::size_t probe) {
  const Patch& patch = model.patches[model.indenters[probe].patch].patch;
  return {.depth_mm = 1.5, .x_mm = 0.5 * patch.length_mm, .y_mm = 0.5 * patch.width_mm};
}

/// The cost of a tick of the default scene.
double default_tick_us() {
  const Scene scene = *preset_scene("paper");
  const ContactInput press = centre_press(scene.model, 0);
  return 1e6 * tick_cost(scene.model, {&press, 1})->median_s;
}

/// The cost of a tick of the whole hand, µs.
struct HandCost {
  double fingertip_alone = 0.0;  ///< the thumb as a scene of its own
  double thumb = 0.0;            ///< pressed, with the rest of the hand at rest
  double all = 0.0;              ///< all pressed, on one thread
  double shared = 0.0;           ///< all pressed, on two threads; 0 where there is one core
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

int bench(const BenchOptions& options) {
  if (auto forced = force_simd_target(options.target); !forced) return refuse(forced.error());
  const std::string target = options.target.empty() ? simd_target() : options.target;
  const double peak[] = {fma_peak_gflops(Precision::kDouble), fma_peak_gflops(Precision::kFloat)};
  const auto peak_of = [&](Precision p) { return peak[p == Precision::kDouble ? 0 : 1]; };
  const auto team = SpinningTeam::create(std::min(2, SpinningTeam::available_cores()));
  WorkerTeam* const two = team && (*team)->size() > 1 ? team->get() : nullptr;

  std::vector<Row> rows;
  for (const bool coupled : {false, true}) {
    for (const std::size_t neurons : {20U, 450U, 2000U, 17'000U}) {
      for (const auto precision : {Precision::kDouble, Precision::kFloat}) {
        const PopulationCase which{.neurons = neurons, .precision = precision, .coupled = coupled};
        rows.push_back(row_of(which));
        if (neurons < 17'000 || two == nullptr) continue;
        PopulationCase shared = which;
        shared.team = two;
        rows.push_back(row_of(shared));
      }
    }
  }
  const double tick_us = default_tick_us();
  const HandCost hand = hand_cost(two);
  const double tick_ms = units::ms_from(preset_scene("paper")->model.tick);

  if (options.json) {
    using Json = nlohmann::ordered_json;
    Json populations = Json::array();
    for (const Row& row : rows) {
      populations.push_back(
          {{"neurons", row.which.neurons},
           {"coupled", row.which.coupled},
           {"precision", name_of(row.which.precision)},
           {"threads", row.threads},
           {"ns_per_neuron_step", row.ns},
           {"ns_per_step", row.ns * static_cast<double>(row.which.neurons)},
           {"times_real_time", row.times_real_time()},
           {"gflops", row.gflops()},
           {"fraction_of_peak", row.gflops() / (row.threads * peak_of(row.which.precision))}});
    }
    const Json result = {{"simd_target", target},
                         {"fma_peak_gflops", {{"double", peak[0]}, {"float", peak[1]}}},
                         {"step_us", 25.0},
                         {"populations", std::move(populations)},
                         {"default_scene_tick_us", tick_us},
                         {"default_scene_times_real_time", 1e3 * tick_ms / tick_us},
                         {"hand_tick_us",
                          {{"fingertip_alone", hand.fingertip_alone},
                           {"one_fingertip_pressed", hand.thumb},
                           {"all_pressed", hand.all},
                           {"all_pressed_two_threads", hand.shared}}}};
    std::printf("%s\n", result.dump(2).c_str());
    return kDone;
  }
  std::printf("instruction set: %s; peak of a core: %.0f GFLOP/s double, %.0f float\n",
              target.c_str(), peak[0], peak[1]);
  std::printf("crank_nicolson, steps of 25 µs, medians\n");
  std::printf("%8s %8s %9s %7s %14s %12s %11s %8s %8s\n", "neurons", "network", "precision",
              "threads", "ns/neuron-step", "ns/step", "× real time", "GFLOP/s", "of peak");
  for (const Row& row : rows) {
    std::printf("%8zu %8s %9s %7d %14.2f %12.0f %11.1f %8.1f %7.0f%%\n", row.which.neurons,
                row.which.coupled ? "yes" : "no", std::string(name_of(row.which.precision)).c_str(),
                row.threads, row.ns, row.ns * static_cast<double>(row.which.neurons),
                row.times_real_time(), row.gflops(),
                100.0 * row.gflops() / (row.threads * peak_of(row.which.precision)));
  }
  std::printf("a tick of %g ms of the default scene: %.2f µs (%.0f × real time)\n", tick_ms,
              tick_us, 1e3 * tick_ms / tick_us);
  std::printf(
      "of the whole hand: %.1f µs with one fingertip pressed (%.2f of that fingertip alone), %.0f "
      "µs "
      "with all pressed, %.0f µs on two threads\n",
      hand.thumb, hand.thumb / hand.fingertip_alone, hand.all, hand.shared);
  return kDone;
}

}  // namespace

void add_bench_command(CommandLine& program) {
  auto options = std::make_shared<BenchOptions>();
  program
      .subcommand("bench",
                  "Measures this machine: time of a membrane step of a neuron for networks of "
                  "several sizes, and of a tick of the default scene.",
                  "bench --json")
      .option("--target", options->target,
              "Instruction set to use instead of the best: avx512, avx2, sse4, neon, scalar")
      .flag("--json", options->json, "Print the results as JSON")
      .runs([options] { return bench(*options); });
}

}  // namespace merkel
