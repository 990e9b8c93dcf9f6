#include "tools/studies/score/regularity.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/scene/afferents.hpp"
#include "core/units.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

/// Neurons of the scene's kind with the energy density as drive in Hz, without adaptation.
Afferents driven_neurons(const TactileModel::Parameters& scene, std::size_t count) {
  TactileModel::Parameters bare = scene;
  bare.adaptation = {
      .gain_Hz_per_kPa = 1.0, .fast_weight = 0.0, .slow_weight = 0.0, .compression_ms = 0.0};
  return *Afferents::create(bare, 0, count, afferent_tables_of(bare));
}

/// Spike times of each neuron under constant drives, s, after one second of settling.
std::vector<std::vector<double>> trains(Afferents& neurons, nanoseconds step,
                                        const std::vector<double>& drive, double seconds) {
  neurons.reset();
  std::vector<std::vector<double>> times(drive.size());
  SpikeBuffer spikes(drive.size() * 12);
  const int steps = std::max(1, static_cast<int>(milliseconds{10} / step));
  const nanoseconds end = units::nanoseconds_from_s(1.0 + seconds);
  for (nanoseconds time{0}; time < end; time += steps * step) {
    spikes.clear();
    neurons.advance(drive, drive, steps, time, spikes, nullptr);
    spikes.sort();
    for (const SpikeEvent& spike : spikes.events()) {
      const double at = units::s_from(spike.time) - 1.0;
      if (at >= 0.0) times[spike.neuron - 1].push_back(at);
    }
  }
  return times;
}

double mean_rate(const std::vector<std::vector<double>>& times, double seconds) {
  double sum = 0.0;
  for (const auto& train : times) sum += static_cast<double>(train.size());
  return sum / (seconds * static_cast<double>(times.size()));
}

}  // namespace

Regularity regularity_at(const TactileModel::Parameters& scene, double rate_hz) {
  constexpr std::size_t kNeurons = 32;
  constexpr double kSeconds = 10.0;
  Afferents neurons = driven_neurons(scene, kNeurons);
  // The leak reduces the drive: correct it until the rate is right.
  double drive = rate_hz;
  std::vector<std::vector<double>> times;
  Regularity found{.wanted_hz = rate_hz};
  for (int attempt = 0; attempt < 5; ++attempt) {
    times = trains(neurons, scene.step, std::vector<double>(kNeurons, drive), kSeconds);
    found.rate_hz = mean_rate(times, kSeconds);
    drive += rate_hz - found.rate_hz;
  }
  double sum = 0.0;
  double sum2 = 0.0;
  double seconds = 0.0;
  double counts = 0.0;
  double counts2 = 0.0;
  for (const auto& train : times) {
    for (std::size_t k = 1; k < train.size(); ++k) {
      const double interval = 1e3 * (train[k] - train[k - 1]);
      found.intervals_ms.push_back(interval);
      sum += interval;
      sum2 += interval * interval;
    }
    for (int second = 0; second < static_cast<int>(kSeconds); ++second) {
      const auto count =
          static_cast<double>(std::count_if(train.begin(), train.end(), [second](double t) {
            return t >= second && t < second + 1;
          }));
      seconds += 1.0;
      counts += count;
      counts2 += count * count;
    }
  }
  const auto n = static_cast<double>(std::max<std::size_t>(1, found.intervals_ms.size()));
  const double mean = sum / n;
  found.cv = mean > 0.0 ? std::sqrt(std::max(0.0, sum2 / n - mean * mean)) / mean
                        : std::numeric_limits<double>::quiet_NaN();
  found.count_sd =
      std::sqrt(std::max(0.0, counts2 / seconds - counts / seconds * counts / seconds));
  return found;
}

std::vector<DriveRate> rates_by_drive(const TactileModel::Parameters& scene) {
  constexpr double kSeconds = 4.0;
  std::vector<double> drives;
  for (int k = 0; k <= 100; ++k) drives.push_back(5.0 * k);
  Afferents neurons = driven_neurons(scene, drives.size());
  const auto times = trains(neurons, scene.step, drives, kSeconds);
  std::vector<DriveRate> rates;
  for (std::size_t k = 0; k < drives.size(); ++k) {
    rates.push_back(
        {.drive_hz = drives[k], .rate_hz = static_cast<double>(times[k].size()) / kSeconds});
  }
  return rates;
}

}  // namespace merkel
