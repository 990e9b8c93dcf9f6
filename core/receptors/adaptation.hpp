#pragma once

#include <chrono>
#include <cstdint>
#include <span>
#include <vector>

#include "core/parameters/parameter_error.hpp"
#include "core/realtime_tag.hpp"

namespace merkel {

/// Converts the mean strain energy density in an afferent's receptive field into a drive, with two
/// states of adaptation.
///
/// Fast adaptation, compression, slow adaptation, in this order:
/// u = g·S; ẋ1 = (u − x1)/τ1; R0 = max(0, (1+k1)·u − k1·x1); R = R0/(1 + c·R0);
/// ẋ3 = (R − x3)/τ3; drive = max(0, (1+k3)·R − k3·x3).
/// The response to a sudden weak step is (1+k1)·(1+k3) times the response to the same energy held
/// for long. Because the slow adaptation follows the compression, a hold adapts by nearly the same
/// fraction at any depth. g, k1 and k3 are fitted to recordings (`merkel fit`); core/README.md
/// describes how the others were found.
struct AdaptationParameters {
  double gain_Hz_per_kPa = 19.9;  ///< g
  double fast_weight = 72.0;      ///< k1
  double slow_weight = 1.05;      ///< k3
  double fast_ms = 2.0;           ///< τ1
  double slow_ms = 3600.0;        ///< τ3
  double compression_ms = 4.7;    ///< c
  double gain_spread = 0.0;       ///< standard deviation of ln g between afferents
  std::uint64_t seed = 1;         ///< of the random gains

  [[nodiscard]] static FieldTable fields();
  [[nodiscard]] Expected<void, ParameterError> check() const;
};

/// The gains and adaptation states of N afferents. Real-time: yes, after construction.
class Adaptation {
 public:
  /// \param parameters  valid
  /// \param afferents  N
  Adaptation(const AdaptationParameters& parameters, std::size_t afferents);

  /// Resets to the state after a long time without energy.
  void reset() noexcept MERKEL_REALTIME;

  /// Advances by an interval in which the energy densities run linearly from `energy_begin` to
  /// `energy_end` (N values each, kPa), and writes the drive at its end, Hz. The fast state is
  /// exact for any length of the interval; the slow state takes R as linear within it.
  void advance(std::span<const double> energy_begin, std::span<const double> energy_end,
               std::chrono::nanoseconds interval,
               std::span<double> drive_Hz) noexcept MERKEL_REALTIME;

  /// Whether every state has decayed to rest: without energy, advance() changes nothing.
  [[nodiscard]] bool at_rest() const noexcept { return at_rest_; }
  /// g of every afferent, Hz/kPa.
  [[nodiscard]] std::span<const double> gains() const noexcept { return gain_; }

 private:
  /// The fraction of a state that remains after an interval, and the weights of the input at its
  /// beginning and end.
  struct Decay {
    double kept = 0.0;
    double of_begin = 0.0;
    double of_end = 0.0;
  };
  [[nodiscard]] static Decay decay_of(double interval_ms, double tau_ms) noexcept;

  AdaptationParameters parameters_;
  std::vector<double> gain_;
  std::vector<double> fast_;
  std::vector<double> slow_;
  std::vector<double> compressed_;  ///< R at the end of the last interval
  bool at_rest_ = true;
  std::chrono::nanoseconds interval_{0};  ///< of fast_decay_ and slow_decay_
  Decay fast_decay_;
  Decay slow_decay_;
};

}  // namespace merkel
