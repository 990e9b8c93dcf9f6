#pragma once

#include <chrono>
#include <cstdint>
#include <span>
#include <vector>

#include "core/parameters/parameter_error.hpp"
#include "core/realtime_tag.hpp"

namespace merkel {

/// How an afferent turns the mean strain energy density in its receptive field into a drive, with
/// two states of adaptation.
///
/// u = g·S; ẋ1 = (u − x1)/τ1; ẋ3 = (u − x3)/τ3; drive = max(0, (1+k1+k3)·u − k1·x1 − k3·x3).
/// A sudden step is felt 1+k1+k3 times as strongly as the same energy held for long. The constants
/// of time are those of Gerling et al. 2018 (doi 10.1371/journal.pcbi.1006264); g, k1 and k3 are
/// fitted to recordings (`merkel fit`).
struct AdaptationParameters {
  double gain_Hz_per_kPa = 18.1;  ///< g
  double fast_weight = 57.0;      ///< k1
  double slow_weight = 1.54;      ///< k3
  double fast_ms = 8.0;           ///< τ1
  double slow_ms = 1832.0;        ///< τ3
  double gain_spread = 0.0;       ///< standard deviation of ln g between afferents
  std::uint64_t seed = 1;         ///< of the spread

  [[nodiscard]] static FieldTable fields();
  [[nodiscard]] Expected<void, ParameterError> check() const;
};

/// The gains and adaptation states of N afferents. Real-time: yes, after construction.
class Adaptation {
 public:
  /// \param parameters  valid.  \param afferents  N
  Adaptation(const AdaptationParameters& parameters, std::size_t afferents);

  /// Back to no energy for ever.
  void reset() noexcept MERKEL_REALTIME;

  /// Goes on by an interval in which the energy densities run linearly from `energy_begin` to
  /// `energy_end` (N values each, kPa), and writes the drive at its end, Hz. The states follow
  /// exactly, however long the interval is: two halves give what the whole gives.
  void advance(std::span<const double> energy_begin, std::span<const double> energy_end,
               std::chrono::nanoseconds interval,
               std::span<double> drive_Hz) noexcept MERKEL_REALTIME;

  /// g of every afferent, Hz/kPa.
  [[nodiscard]] std::span<const double> gains() const noexcept { return gain_; }

 private:
  /// What is left of a state after an interval, and what the input at its begin and end adds.
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
  std::chrono::nanoseconds interval_{0};  ///< that the decays are of
  Decay fast_decay_;
  Decay slow_decay_;
};

}  // namespace merkel
