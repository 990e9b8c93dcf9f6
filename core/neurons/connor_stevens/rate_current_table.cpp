#include "core/neurons/connor_stevens/rate_current_table.hpp"

#include <algorithm>
#include <cassert>

#include "core/neurons/connor_stevens/connor_stevens_group.hpp"
#include "core/units.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr milliseconds kSettle{300};
constexpr milliseconds kMeasure{2500};
/// How far below the onset an undriven neuron rests, so that noise rarely makes it fire.
constexpr double kBelowOnset = 0.33;

std::vector<double> currents_to_try() {
  std::vector<double> currents;
  for (int k = 350; k < 450; ++k) currents.push_back(0.02 * k);
  for (int k = 36; k < 64; ++k) currents.push_back(0.25 * k);
  for (int k = 32; k <= 120; ++k) currents.push_back(0.5 * k);
  return currents;
}

/// The rate of each neuron at its constant current, from its interspike intervals; 0 if there are
/// too few.
std::vector<double> steady_rates(const ConnorStevens& neuron, nanoseconds step,
                                 const std::vector<double>& currents) {
  ConnorStevens quiet = neuron;
  quiet.noise.sigma = 0.0;
  ConnorStevensGroup neurons({.neuron = quiet, .step = step}, currents.size());
  std::vector<int> count(currents.size());
  std::vector<nanoseconds> first(currents.size());
  std::vector<nanoseconds> last(currents.size());
  SpikeBuffer spikes(currents.size() * 16);
  const int steps = static_cast<int>(milliseconds{10} / step);
  for (nanoseconds time{0}; time < kSettle + kMeasure; time += steps * step) {
    spikes.clear();
    neurons.advance(currents, currents, steps, time, spikes);
    if (time < kSettle) continue;
    for (const SpikeEvent& spike : spikes.events()) {
      const std::size_t n = spike.neuron - 1;
      if (count[n]++ == 0) first[n] = spike.time;
      last[n] = std::max(last[n], spike.time);
    }
  }
  std::vector<double> rates(currents.size());
  for (std::size_t n = 0; n < rates.size(); ++n) {
    if (count[n] >= 3) rates[n] = (count[n] - 1) / units::s_from(last[n] - first[n]);
  }
  return rates;
}

/// y at x by linear interpolation in a rising table; constant beyond its ends.
double interpolated(const std::vector<double>& xs, const std::vector<double>& ys, double x) {
  if (x <= xs.front()) return ys.front();
  if (x >= xs.back()) return ys.back();
  const auto above = std::upper_bound(xs.begin(), xs.end(), x);
  const auto k = static_cast<std::size_t>(above - xs.begin());
  return ys[k - 1] + (ys[k] - ys[k - 1]) * ((x - xs[k - 1]) / (xs[k] - xs[k - 1]));
}

}  // namespace

RateCurrentTable::RateCurrentTable(const ConnorStevens& neuron, nanoseconds step) {
  const std::vector<double> currents = currents_to_try();
  const std::vector<double> rates = steady_rates(neuron, step, currents);
  for (std::size_t k = 0; k < currents.size(); ++k) {
    if (rates[k] <= 0.0) continue;
    if (rate_.empty()) {
      rate_.push_back(0.0);
      current_.push_back(currents[k] - kBelowOnset);
    }
    // Where more current no longer gives more spikes, the curve cannot be inverted.
    if (rates[k] <= rate_.back()) break;
    rate_.push_back(rates[k]);
    current_.push_back(currents[k]);
  }
}

double RateCurrentTable::current_uA_per_cm2(double rate_Hz) const noexcept {
  assert(valid());
  return interpolated(rate_, current_, rate_Hz);
}

double RateCurrentTable::rate_Hz(double current_uA_per_cm2) const noexcept {
  assert(valid());
  return interpolated(current_, rate_, current_uA_per_cm2);
}

}  // namespace merkel
