#include "tools/studies/report/spike_train_error.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "core/units.hpp"

namespace merkel {
namespace {

constexpr double kWindow_ms = 5.0;

using NumberedTrains = std::map<std::pair<std::uint16_t, std::uint32_t>, std::vector<double>>;

NumberedTrains trains_of(std::span<const SpikeEvent> spikes) {
  NumberedTrains trains;
  for (const SpikeEvent& spike : spikes) {
    trains[{spike.patch, spike.neuron}].push_back(units::ms_from(spike.time));
  }
  return trains;
}

}  // namespace

SpikeTrainError spike_train_error(std::span<const SpikeEvent> spikes,
                                  std::span<const SpikeEvent> reference) {
  NumberedTrains ours = trains_of(spikes);
  NumberedTrains theirs = trains_of(reference);
  for (const auto& [neuron, train] : ours) theirs[neuron];
  SpikeTrainError error;
  std::vector<double> distances;
  for (const auto& [neuron, expected] : theirs) {
    const std::vector<double>& found = ours[neuron];
    const bool in_order = found.size() == expected.size();
    std::size_t i = 0;
    std::size_t j = 0;
    while (i < found.size() && j < expected.size()) {
      const double apart = found[i] - expected[j];
      if (in_order || std::fabs(apart) <= kWindow_ms) {
        distances.push_back(std::fabs(apart));
        ++i;
        ++j;
      } else {
        ++error.unmatched;
        ++(apart < 0.0 ? i : j);
      }
    }
    error.unmatched += (found.size() - i) + (expected.size() - j);
  }
  error.matched = distances.size();
  if (distances.empty()) return error;
  double sum2 = 0.0;
  for (const double distance : distances) sum2 += distance * distance;
  error.rms_ms = std::sqrt(sum2 / static_cast<double>(distances.size()));
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  error.median_ms = *middle;
  return error;
}

}  // namespace merkel
