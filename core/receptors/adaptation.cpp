#include "core/receptors/adaptation.hpp"

#include <algorithm>
#include <cassert>

#include "core/math/normal_random.hpp"
#include "core/math/portable_math.hpp"
#include "core/units.hpp"

namespace merkel {
namespace {

/// Smaller states are set to 0; they are far too small to move a spike.
constexpr double kNothing_Hz = 1e-9;

}  // namespace

FieldTable AdaptationParameters::fields() {
  using P = AdaptationParameters;
  static constexpr Field kFields[] = {
      {"gain_Hz_per_kPa", "Hz/kPa", not_negative(1e6),
       "steady drive per unit of mean energy density in the receptive field",
       at<&P::gain_Hz_per_kPa>, "", true},
      {"fast_weight", "", not_negative(1e6), "weight of the fast adaptation", at<&P::fast_weight>,
       "", true},
      {"slow_weight", "", not_negative(1e6), "weight of the slow adaptation", at<&P::slow_weight>,
       "", true},
      {"fast_ms", "ms", positive(1e6), "time constant of the fast adaptation", at<&P::fast_ms>, "",
       true},
      {"slow_ms", "ms", positive(1e7), "time constant of the slow adaptation", at<&P::slow_ms>, "",
       true},
      {"compression_ms", "ms", not_negative(1e6),
       "compression between the fast and the slow adaptation: R0/(1 + compression·R0)",
       at<&P::compression_ms>, "", true},
      {"gain_spread", "", from_below(0.0, 2.0), "standard deviation of ln(gain) between afferents",
       at<&P::gain_spread>},
      {"seed", "", any_value(), "seed of the gains", at<&P::seed>}};
  return {"afferent", kFields};
}

Expected<void, ParameterError> AdaptationParameters::check() const {
  return ParameterCheck().fields(*this).result();
}

Adaptation::Adaptation(const AdaptationParameters& parameters, std::size_t afferents)
    : parameters_(parameters),
      gain_(afferents, parameters.gain_Hz_per_kPa),
      fast_(afferents),
      slow_(afferents),
      compressed_(afferents) {
  if (parameters.gain_spread <= 0.0) return;
  for (std::size_t n = 0; n < afferents; ++n) {
    gain_[n] *= portable_exp(parameters.gain_spread * normal_random(parameters.seed, n, 0));
  }
}

void Adaptation::reset() noexcept {
  std::fill(fast_.begin(), fast_.end(), 0.0);
  std::fill(slow_.begin(), slow_.end(), 0.0);
  std::fill(compressed_.begin(), compressed_.end(), 0.0);
  at_rest_ = true;
}

Adaptation::Decay Adaptation::decay_of(double interval_ms, double tau_ms) noexcept {
  // x(T) = x(0)·e^{−r} + ∫ u(t)·e^{−(T−t)/τ} dt/τ with r = T/τ and u linear.
  const double r = interval_ms / tau_ms;
  const double kept = portable_exp(-r);
  const double mean = -portable_expm1(-r) / r;
  return {.kept = kept, .of_begin = mean - kept, .of_end = 1.0 - mean};
}

void Adaptation::advance(std::span<const double> energy_begin, std::span<const double> energy_end,
                         std::chrono::nanoseconds interval, std::span<double> drive_Hz) noexcept {
  assert(energy_begin.size() == gain_.size() && energy_end.size() == gain_.size());
  assert(drive_Hz.size() == gain_.size() && interval.count() > 0);
  if (interval != interval_) {
    interval_ = interval;
    fast_decay_ = decay_of(units::ms_from(interval), parameters_.fast_ms);
    slow_decay_ = decay_of(units::ms_from(interval), parameters_.slow_ms);
  }
  const double k1 = parameters_.fast_weight;
  const double k3 = parameters_.slow_weight;
  const double c = 1e-3 * parameters_.compression_ms;
  double largest = 0.0;
  for (std::size_t n = 0; n < gain_.size(); ++n) {
    const auto go_on = [](double x, const Decay& decay, double begin, double end) {
      const double after = decay.kept * x + (decay.of_begin * begin + decay.of_end * end);
      return after < kNothing_Hz ? 0.0 : after;
    };
    const double end = gain_[n] * energy_end[n];
    fast_[n] = go_on(fast_[n], fast_decay_, gain_[n] * energy_begin[n], end);
    const double felt = std::max(0.0, (1.0 + k1) * end - k1 * fast_[n]);
    const double before = compressed_[n];
    compressed_[n] = felt / (1.0 + c * felt);
    slow_[n] = go_on(slow_[n], slow_decay_, before, compressed_[n]);
    drive_Hz[n] = std::max(0.0, (1.0 + k3) * compressed_[n] - k3 * slow_[n]);
    largest = std::max({largest, fast_[n], slow_[n], compressed_[n]});
  }
  at_rest_ = largest == 0.0;
}

}  // namespace merkel
