// Chart 4: where the methods give correct or wrong spike counts, or diverge.
#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/core.h>

#include "core/neurons/hodgkin_huxley/driven_neurons.hpp"
#include "core/neurons/hodgkin_huxley/lattice_coupling.hpp"
#include "tools/filled_text.hpp"
#include "tools/studies/charts/chart.hpp"

namespace merkel {
namespace {

constexpr double kSearch_ms = 300.0;

enum Outcome { kRight = 0, kWrongCount = 1, kDiverged = 2 };

std::vector<int> counts(const DrivenNeurons& driven, std::size_t neurons) {
  std::vector<int> of_neuron(neurons);
  for (const SpikeEvent& spike : driven.spikes) ++of_neuron[spike.neuron - 1];
  return of_neuron;
}

/// One spike more or less at the end of the interval is not an error of the method.
Outcome outcome_of(int spikes, int expected, bool diverged) {
  if (diverged) return kDiverged;
  return std::abs(spikes - expected) <= 1 + expected / 50 ? kRight : kWrongCount;
}

const std::vector<double> kSteps_us = {5,  12.5, 25, 50, 55,  60,  65,  70, 75,
                                       80, 85,   90, 95, 100, 125, 200, 500};

}  // namespace

Expected<std::string, SetupError> make_stability_chart(const ReportFolder& folder,
                                                       ReportTables& tables) {
  CsvTable& table = tables.at("stability.csv");
  std::vector<double> currents;
  for (double I = 0.0; I <= 160.0; I += 10.0) currents.push_back(I);
  const std::vector<double> gains = {0.1,  1.0,  5.0,   10.0,  20.0, 25.0,
                                     40.0, 79.0, 120.0, 200.0, 500.0};
  std::vector<double> on_grid(20);
  for (std::size_t i = 0; i < on_grid.size(); ++i) on_grid[i] = static_cast<double>(i);

  const auto expected =
      counts(drive_neurons(currents, kSearch_ms, IntegrationMethod::kRk4, Precision::kDouble, 2.5),
             currents.size());
  std::vector<int> expected_on_grid;
  for (const double gain : gains) {
    const auto network = LatticeCoupling::create({.gain = gain}, 5, 4);
    expected_on_grid.push_back(
        static_cast<int>(drive_neurons(on_grid, kSearch_ms, IntegrationMethod::kRk4,
                                       Precision::kDouble, 1.0, *network)
                             .spikes.size()));
  }
  std::string text = filled_page("chart_stability");
  const auto& names = integration_method_names();
  for (std::size_t k = 0; k < names.size(); ++k) {
    const auto method = static_cast<IntegrationMethod>(k);
    double largest[4] = {0.0, 0.0, 0.0, 0.0};
    bool right[4] = {true, true, true, true};  ///< at all steps so far
    for (const double step_us : kSteps_us) {
      for (std::size_t i = 0; i < currents.size(); ++i) {
        const auto driven =
            drive_neurons({currents[i]}, kSearch_ms, method, Precision::kDouble, step_us);
        const Outcome outcome =
            outcome_of(static_cast<int>(driven.spikes.size()), expected[i], driven.resets > 0);
        table.row({names[k]}, {step_us, currents[i], 0.0, static_cast<double>(outcome)});
        right[0] = right[0] && (currents[i] != 10.0 || outcome == kRight);
        right[1] = right[1] && (currents[i] > 60.0 || outcome == kRight);
      }
      for (std::size_t i = 0; i < gains.size(); ++i) {
        const auto network = LatticeCoupling::create({.gain = gains[i]}, 5, 4);
        const auto driven =
            drive_neurons(on_grid, kSearch_ms, method, Precision::kDouble, step_us, *network);
        // Counts of all neurons together: single spike times are ill-conditioned near threshold.
        const int spikes = static_cast<int>(driven.spikes.size());
        const bool close = std::abs(spikes - expected_on_grid[i]) <= 5 + expected_on_grid[i] / 10;
        const Outcome outcome = driven.resets > 0 ? kDiverged : close ? kRight : kWrongCount;
        table.row({names[k]}, {step_us, 0.0, gains[i], static_cast<double>(outcome)});
        right[2] = right[2] && (gains[i] != 0.1 || outcome == kRight);
        right[3] = right[3] && (gains[i] != 25.0 || outcome == kRight);
      }
      for (int column = 0; column < 4; ++column) {
        if (right[column]) largest[column] = step_us;
      }
    }
    text += "| " + names[k] + " |";
    for (const double step_us : largest) {
      text += step_us > 0.0 ? fmt::format(" {:g} µs |", step_us) : std::string(" – |");
    }
    text += "\n";
    folder.report(static_cast<double>(k + 1) / static_cast<double>(names.size()));
  }
  return text + "\n";
}

}  // namespace merkel
