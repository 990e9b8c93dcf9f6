#include "drivers/probes/taxel_readings.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "core/printed.hpp"
#include "core/units.hpp"
#include "drivers/printable_text.hpp"
#include "drivers/sample_limits.hpp"

namespace merkel {
namespace {

constexpr int kZeroReadings = 20;
constexpr int kMinZeroReadings = 5;  ///< of a slow device, after
constexpr std::chrono::milliseconds kMaxZero{1000};
constexpr double kNoises = 5.0;  ///< a value that exceeds as many times the noise is a touch
constexpr double kDrift_s =
    20.0;                    ///< the largest drift is that of the noise threshold in this time
constexpr int kStuck = 500;  ///< equal readings of a taxel that has noise
constexpr std::size_t kMaxNamed = 5;
constexpr double kPressed_mN = 200.0;

std::string names_of_taxels(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), kMaxNamed); ++i) {
    text += (i == 0 ? "" : ", ") + printable_text(names[i]);
  }
  if (names.size() > kMaxNamed)
    text += " and " + std::to_string(names.size() - kMaxNamed) + " more";
  return text;
}

}  // namespace

TaxelReadings::TaxelReadings(std::string name, std::vector<ChannelName> channels,
                             const ChannelSelection::Taxels& array)
    : name_(std::move(name)),
      zeros_kPa_(channels.size()),
      changed_zeros_(channels.size()),
      area_mm2_(array.area_mm2),
      tracks_(array.tracks) {
  for (ChannelName& channel : channels) {
    const double to_kPa =
        channel.quantity == Quantity::kForce ? units::mN_from_N(1.0) / area_mm2_ : 1.0;
    channels_.push_back({.channel = std::move(channel), .to_kPa = to_kPa});
  }
}

void TaxelReadings::start_zero() noexcept {
  zeroed_ = 0;
  zero_known_ = false;
  for (Taxel& taxel : channels_) {
    taxel.sum = taxel.sum2 = 0.0;
    taxel.count = 0;
  }
}

void TaxelReadings::measure_zero(const DeviceReading& reading) {
  for (Taxel& taxel : channels_) {
    const double value = reading[taxel.channel.channel];
    if (!std::isfinite(value)) continue;
    if (taxel.count++ == 0) taxel.first = value;
    taxel.sum += value - taxel.first;
    taxel.sum2 += (value - taxel.first) * (value - taxel.first);
  }
  if (zeroed_++ == 0) zero_began_ = reading.arrival;
}

void TaxelReadings::finish_zero(std::vector<std::string>& notices) {
  zero_known_ = true;
  std::vector<std::string> constant;
  double noise2_kPa = 0.0;
  double moved_mN = 0.0;
  std::size_t noisy = 0;
  for (Taxel& taxel : channels_) {
    taxel.absent = taxel.count == 0;
    if (taxel.absent) continue;
    const double mean = taxel.sum / taxel.count;
    const double noise = std::sqrt(std::max(0.0, taxel.sum2 / taxel.count - mean * mean));
    moved_mN += std::fabs(taxel.first + mean - taxel.zero) * taxel.to_kPa * area_mm2_;
    taxel.zero = taxel.first + mean;
    taxel.least = kNoises * noise;
    taxel.same = 0;
    taxel.touching = false;
    taxel.drift.reset();
    if (noise > 0.0) {
      if (tracks_) taxel.drift.emplace(taxel.least, taxel.least / kDrift_s, true);
      ++noisy;
    } else {
      constant.push_back(taxel.channel.name);
    }
    noise2_kPa += noise * taxel.to_kPa * noise * taxel.to_kPa;
  }
  const double noise_kPa = std::sqrt(noise2_kPa / static_cast<double>(channels_.size()));
  std::string sentence = name_ + ": zero and noise of " + std::to_string(channels_.size()) +
                         " taxels measured over " + std::to_string(zeroed_) +
                         " readings: " + printed("%.3g kPa rms", noise_kPa);
  if (moved_mN > kPressed_mN) {
    sentence +=
        "; their zero has changed by " + printed("%.3g", units::N_from_mN(moved_mN)) +
        " N in all: if the array was pressed, lift it and tare it: by the live page (--sink "
        "'view:8080?control=1'), by tare() of a Bridge in Python, or by starting again";
  }
  notices.push_back(std::move(sentence));
  name_absent(notices);
  // If all are constant, the array rounds to its zero.
  if (!constant.empty() && constant.size() < noisy) {
    notices.push_back(
        name_ + ": " + names_of_taxels(constant) +
        " never changed at rest, unlike the others: dead, or at the end of its range?");
  }
}

/// A taxel that has noise and then stays at one value is at the end of its range, or disconnected.
void TaxelReadings::watch(Taxel& taxel, double value) noexcept {
  const bool absent = !std::isfinite(value);
  taxel.same = value == taxel.last ? taxel.same + 1 : 0;
  taxel.last = value;
  const bool stuck = taxel.least > 0.0 && taxel.same >= kStuck;
  changed_ = changed_ || (stuck && !taxel.stuck) || (absent && !taxel.absent);
  taxel.stuck = stuck;
  taxel.absent = absent;
}

void TaxelReadings::name_stuck(std::vector<std::string>& notices) {
  changed_ = false;
  std::vector<std::string> stuck;
  for (const Taxel& taxel : channels_) {
    if (taxel.stuck) stuck.push_back(taxel.channel.name);
  }
  if (!stuck.empty()) {
    notices.push_back(name_ + ": " + names_of_taxels(stuck) +
                      " stopped changing: at the end of its range, or dead");
  }
  name_absent(notices);
}

void TaxelReadings::name_absent(std::vector<std::string>& notices) {
  std::vector<std::string> absent;
  std::vector<std::string> unnamed;
  for (Taxel& taxel : channels_) {
    if (!taxel.absent) continue;
    absent.push_back(taxel.channel.name);
    if (!std::exchange(taxel.named, true)) unnamed.push_back(taxel.channel.name);
  }
  if (absent.size() > most_out_) {
    most_out_ = absent.size();
    lack_ = std::to_string(most_out_) + " of its " + std::to_string(channels_.size()) +
            " taxels had no value (" + names_of_taxels(absent) + ")";
  }
  if (unnamed.empty()) return;
  notices.push_back(name_ + ": no value from " + names_of_taxels(unnamed) +
                    ": taken as 0; check its wiring");
}

/// How far a value is above the zero of its taxel, which follows its drift.
double TaxelReadings::above_zero(Taxel& taxel, double value,
                                 std::chrono::nanoseconds time) noexcept {
  const double above = value - taxel.zero;
  if (!taxel.drift || !std::isfinite(value)) return above;
  double zero = taxel.drift->follow(time, above);
  if (!taxel.touching && above - zero > taxel.least) {
    zero = taxel.drift->begin_contact();
    taxel.touching = true;
  } else if (taxel.touching && above - zero < 0.5 * taxel.least) {
    taxel.drift->end_contact();
    taxel.touching = false;
  }
  return above - zero;
}

bool TaxelReadings::take(const DeviceReading& reading, std::span<double> kPa,
                         std::vector<std::string>& notices) {
  if (tare_.pending()) {
    tare_.cancel();
    start_zero();
  }
  if (!zero_known_) {
    measure_zero(reading);
    const bool slow = zeroed_ >= kMinZeroReadings && reading.arrival - zero_began_ >= kMaxZero;
    if (zeroed_ < kZeroReadings && !slow) return false;
    finish_zero(notices);
  }
  out_ = 0;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    Taxel& taxel = channels_[i];
    const double value = taxel.gap.take(reading[taxel.channel.channel]);
    watch(taxel, value);
    if (taxel.absent) ++out_;
    const double above = above_zero(taxel, value, reading.arrival);
    const double pressure = above * taxel.to_kPa;
    // Also false for NaN.
    const bool touched = above > taxel.least && pressure <= SampleLimits::kPressure_kPa;
    kPa[i] = touched ? static_cast<double>(static_cast<float>(pressure)) : 0.0;
  }
  if (changed_) name_stuck(notices);
  return true;
}

std::span<const TaxelZeros> TaxelReadings::changed_zeros() {
  std::ranges::transform(channels_, zeros_kPa_.begin(), [](const Taxel& taxel) {
    const double drift = taxel.drift ? taxel.drift->zero() : 0.0;
    return static_cast<float>((taxel.zero + drift) * taxel.to_kPa);
  });
  return changed_zeros_.changed(zeros_kPa_, {}, 0, 0);
}

double TaxelReadings::force_mN(std::span<const double> kPa) const noexcept {
  double sum = 0.0;
  for (const double pressure : kPa) sum += pressure;
  return sum * area_mm2_;
}

bool TaxelReadings::uncertain(std::span<const double> kPa) const noexcept {
  double all = 0.0;
  double doubtful = 0.0;
  for (std::size_t i = 0; i < kPa.size(); ++i) {
    all += kPa[i];
    if (channels_[i].drift && channels_[i].drift->uncertain()) doubtful += kPa[i];
  }
  return doubtful > 0.5 * all;
}

std::vector<ChannelName> taxel_channels(std::span<const ChannelName> channels,
                                        const std::string& prefix) {
  std::vector<ChannelName> taxels;
  for (const ChannelName& each : channels) {
    const bool measures = is_named(each.channel) && (each.quantity == Quantity::kForce ||
                                                     each.quantity == Quantity::kPressure);
    if (measures && each.name.starts_with(prefix)) taxels.push_back(each);
  }
  return taxels;
}

}  // namespace merkel
