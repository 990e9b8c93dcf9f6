// Chart 1: speed against accuracy of the integration methods.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <vector>

#include <fmt/core.h>

#include "core/neurons/hodgkin_huxley/driven_neurons.hpp"
#include "core/units.hpp"
#include "drivers/files/output_file.hpp"
#include "tools/child_process.hpp"
#include "tools/filled_text.hpp"
#include "tools/studies/bench/population_cost.hpp"
#include "tools/studies/charts/chart.hpp"
#include "tools/studies/report/plot_runner.hpp"
#include "tools/studies/report/spike_train_error.hpp"
#ifdef MERKEL_HAS_CVODE
#include "tools/studies/reference/cvode_membrane.hpp"
#endif

namespace merkel {
namespace {

constexpr double kDuration_ms = 500.0;
constexpr std::size_t kTimedNeurons = 2000;

std::vector<double> currents() {
  std::vector<double> all;
  for (int i = 0; i < 8; ++i) all.push_back(8.0 + 6.0 * i / 8.0);
  return all;
}

const char* enumerator_of(IntegrationMethod method) {
  switch (method) {
    case IntegrationMethod::kForwardEuler:
      return "kForwardEuler";
    case IntegrationMethod::kExponentialEuler:
      return "kExponentialEuler";
    case IntegrationMethod::kBackwardEuler:
      return "kBackwardEuler";
    case IntegrationMethod::kRushLarsen:
      return "kRushLarsen";
    case IntegrationMethod::kCrankNicolson:
      return "kCrankNicolson";
    case IntegrationMethod::kHeun:
      return "kHeun";
    case IntegrationMethod::kRk4:
      return "kRk4";
    case IntegrationMethod::kStaggeredMultistep:
      return "kStaggeredMultistep";
  }
  return "";
}

/// Cost of a neuron per simulated second, µs.
double cost_us(double s_per_step, double step_us) { return 1e6 * s_per_step * 1e6 / step_us; }

/// Cost of a step, s: the median of pairs with the same reference method, so that other load
/// affects both. It depends on the step's length only because Crank–Nicolson computes exponentials
/// for the gates from kExponentialGates_ms on.
class StepCosts {
 public:
  double of(IntegrationMethod method, Precision precision, double step_us) {
    std::vector<double> ratios;
    for (int pair = 0; pair < kPairs; ++pair) {
      const double base = measured(IntegrationMethod::kCrankNicolson, Precision::kDouble, 25.0);
      ratios.push_back(measured(method, precision, step_us) / base);
      base_s_ = std::min(base_s_, base);
    }
    std::sort(ratios.begin(), ratios.end());
    return ratios[ratios.size() / 2] * base_s_;
  }

 private:
  static constexpr int kPairs = 9;
  static double measured(IntegrationMethod method, Precision precision, double step_us) {
    return neuron_step_cost({.neurons = kTimedNeurons,
                             .method = method,
                             .precision = precision,
                             .step_us = step_us},
                            1, 0.005)
        .median_s;
  }
  double base_s_ = std::numeric_limits<double>::infinity();
};

#ifdef MERKEL_HAS_CVODE
struct CvodeRun {
  std::vector<SpikeEvent> spikes;
  double cost_us = 0.0;
};
CvodeRun run_cvode(double tolerance) {
  CvodeRun run;
  const std::vector<double> all = currents();
  const auto begin = std::chrono::steady_clock::now();
  for (std::size_t i = 0; i < all.size(); ++i) {
    reference::CvodeMembranes membranes;
    membranes.relative_tolerance = tolerance;
    membranes.absolute_tolerance = 0.01 * tolerance;
    membranes.current = [&, i](int, double) { return all[i]; };
    for (const auto& spike : membranes.spikes_until(kDuration_ms)) {
      run.spikes.push_back({.time = units::nanoseconds_from_ms(spike.time_ms),
                            .neuron = static_cast<std::uint32_t>(i + 1)});
    }
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  run.cost_us = 1e6 * took.count() / static_cast<double>(all.size()) / (1e-3 * kDuration_ms);
  return run;
}
#endif

constexpr double kChartedSteps_us[] = {200.0, 100.0, 50.0, 25.0, 12.5, 6.25};

/// The cost and error of a method: a row of the report and a row of the table of `merkel plan`.
struct MethodRows {
  std::string report;
  std::string known = {};
};

/// Also writes a line per step to `table`.
MethodRows measure_method(IntegrationMethod method, Precision precision,
                          const std::vector<SpikeEvent>& reference, StepCosts& step_costs,
                          CsvTable& table) {
  const double step_s = step_costs.of(method, precision, 25.0);
  const double long_step_s =
      method == IntegrationMethod::kCrankNicolson ? step_costs.of(method, precision, 50.0) : step_s;
  MethodRows rows{.report = fmt::format("| {} | {} |", name_of(method), name_of(precision))};
  for (const double step_us : kChartedSteps_us) {
    const auto driven = drive_neurons(currents(), kDuration_ms, method, precision, step_us);
    const SpikeTrainError error = spike_train_error(driven.spikes, reference);
    const double cost =
        cost_us(1e-3 * step_us < kExponentialGates_ms ? step_s : long_step_s, step_us);
    const bool right = driven.resets == 0 && error.unmatched == 0;
    rows.known += rows.known.empty() ? "" : ", ";
    rows.known += right ? fmt::format("{:.3g}", 1e3 * error.rms_ms) : "kInfinite";
    table.row({name_of(method), name_of(precision)},
              {step_us, cost, error.rms_ms, driven.resets > 0 ? 1.0 : error.share_unmatched()});
    if (step_us > 100.0 || step_us < 10.0) continue;
    rows.report += right ? fmt::format(" {:.0f} µs → {:.2g} ms |", cost, error.rms_ms)
                         : fmt::format(" {:.0f} µs → – |", cost);
  }
  rows.report += "\n";
  rows.known =
      fmt::format("{{IntegrationMethod::{}, Precision::{}, {:.2f}, {:.2f}, {{{}}}}},\n",
                  enumerator_of(method), precision == Precision::kDouble ? "kDouble" : "kFloat",
                  1e9 * step_s, 1e9 * long_step_s, rows.known);
  return rows;
}

/// CVODE at several tolerances.
std::string measure_cvode([[maybe_unused]] const std::vector<SpikeEvent>& reference,
                          [[maybe_unused]] CsvTable& table) {
#ifdef MERKEL_HAS_CVODE
  std::string text = "\n| CVODE tolerance | cost | rms error |\n|---|---|---|\n";
  for (int power = 3; power <= 10; ++power) {
    const double tolerance = std::pow(10.0, -power);
    const CvodeRun run = run_cvode(tolerance);
    const SpikeTrainError error = spike_train_error(run.spikes, reference);
    table.row({"cvode", "double"}, {tolerance, run.cost_us, error.rms_ms, error.share_unmatched()});
    text += fmt::format("| 1e-{} | {:.0f} µs | {:.2g} ms |\n", power, run.cost_us, error.rms_ms);
  }
  return text;
#else
  return "\nCVODE is not in this build: install libsundials-dev and rebuild.\n";
#endif
}

/// The points of other simulators, if they are installed.
Expected<std::string, SetupError> measure_peers(const ReportFolder& folder) {
  if (!python_has("brian2") && !python_has("neuron")) {
    return "\nNeither Brian2 (python3-brian) nor NEURON (python3-neuron) is installed: their points "
           "are missing.\n";
  }
  const auto run = run_script("compare_peers", {own_program(), "--csv", folder.path("peers.csv")});
  if (!run) return Unexpected<SetupError>(run.error());
  return "\nThe points of other simulators are in `peers.csv`.\n";
}

}  // namespace

Expected<std::string, SetupError> make_integrators_chart(const ReportFolder& folder,
                                                         ReportTables& tables) {
  CsvTable& table = tables.at("integrators.csv");
  // RK4 at this step is within 1e-7 ms of CVODE at 1e-12.
  const auto reference =
      drive_neurons(currents(), kDuration_ms, IntegrationMethod::kRk4, Precision::kDouble, 0.5)
          .spikes;
  std::string text = filled_page("chart_integrators");
  // The prior knowledge of `merkel plan`: replaces tools/studies/plan/method_table.inc.
  auto known = OutputFile::create(folder.path("method_table.inc"), folder.overwrite);
  if (!known) return Unexpected<SetupError>(known.error());
  std::string known_text = filled_page("method_table");
  StepCosts step_costs;
  const std::size_t methods = integration_method_names().size();
  for (std::size_t k = 0; k < methods; ++k) {
    for (const auto precision : {Precision::kDouble, Precision::kFloat}) {
      const MethodRows rows = measure_method(static_cast<IntegrationMethod>(k), precision,
                                             reference, step_costs, table);
      text += rows.report;
      known_text += rows.known;
      folder.report((static_cast<double>(k) + (precision == Precision::kFloat ? 1.0 : 0.5)) /
                    static_cast<double>(methods));
    }
  }
  text += measure_cvode(reference, table);
  if (!known->write(known_text) || !known->close()) return unavailable(known->error());
  const auto peers = measure_peers(folder);
  if (!peers) return peers;
  return text + *peers + "\n";
}

}  // namespace merkel
