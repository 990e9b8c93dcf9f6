#pragma once

#include <chrono>
#include <cstdint>
#include <limits>
#include <optional>

#include "core/contact/indenter.hpp"
#include "core/contact/zero_tracker.hpp"
#include "core/realtime_tag.hpp"
#include "core/records/probe_sample.hpp"

namespace merkel {

/// Decides for every sample of a probe, in order, what its zero is and whether it touches. This is
/// the only definition of contact: the loop, the sinks, the summary and the page use its result,
/// which sessions record. It works on the samples alone.
///
/// A contact begins when the reading that drives the model is positive and the measured force has
/// reached contact_N; of a probe that is driven by its depth, the depth must have reached
/// contact_mm too. It ends when one of them has been below half of that for 10 ms. Without a
/// threshold, any positive reading is a contact. Real-time: yes.
class ContactDecision {
 public:
  enum class Zero {
    kTrack,  ///< follows the drift of the sensor (ZeroTracker); needs contact_N
    kFixed,  ///< that of the sensor and its calibration
    kStart,  ///< the mean force of the first 0.5 s, in which nothing may touch
  };
  struct Parameters {
    double contact_N = 0.0;   ///< force that begins a contact; 0: any positive force
    double contact_mm = 0.0;  ///< depth that begins a contact; 0: any positive depth
    /// Default: kTrack for a device with contact_N, kFixed for a recording.
    std::optional<Zero> zero = {};
    double zero_drift_mN_per_s = 0.6;  ///< the largest drift of the sensor
    bool invert_force = false;         ///< the sensor reports compression as negative
    Indenter::Control control = Indenter::Control::kForce;

    [[nodiscard]] bool has_threshold() const noexcept {
      return contact_N > 0.0 || contact_mm > 0.0;
    }
  };
  /// How a force's zero has changed; of a fixed zero, how its level at rest has changed: the least
  /// mean of a second at rest in ten seconds, of the first ten that have one and of the last.
  struct Drift {
    double first_mN = 0.0;
    double last_mN = 0.0;
    std::chrono::nanoseconds first{0};
    std::chrono::nanoseconds last{0};
    std::chrono::nanoseconds uncertain{0};  ///< total time for which the zero was uncertain
    bool followed = false;                  ///< the zero was tracked

    [[nodiscard]] double change_mN() const noexcept { return last_mN - first_mN; }
  };

  /// \param recorded  the samples are those of a recording: their zero is that of the recording
  ///     where it has one
  ContactDecision(const Parameters& parameters, bool recorded) noexcept;

  /// Sets the zero, Touch and kZeroUncertain of a sample, and subtracts the zero from its force. A
  /// sample that is kTared starts the zero anew.
  void decide(ProbeSample& sample) noexcept MERKEL_REALTIME;

  [[nodiscard]] Drift drift() const noexcept;

 private:
  [[nodiscard]] double zero_of(const ProbeSample& sample, double force_mN) noexcept;
  [[nodiscard]] bool reaches(const ProbeSample& sample, double force_mN,
                             double share) const noexcept;
  void start_anew() noexcept;
  void follow_drift(const ProbeSample& sample, double force_mN) noexcept;
  void follow_rest(const ProbeSample& sample, double force_mN) noexcept;
  void end_second(std::chrono::nanoseconds time) noexcept;

  Parameters parameters_;
  Zero zero_;
  ZeroTracker tracker_;
  bool touching_ = false;
  std::chrono::nanoseconds reached_{0};  ///< when the thresholds were last reached
  // Of kStart:
  std::optional<std::chrono::nanoseconds> began_;
  double sum_mN_ = 0.0;
  std::uint64_t summed_ = 0;
  bool started_ = false;
  Drift drift_;  ///< of the zero
  bool any_ = false;
  std::chrono::nanoseconds previous_{0};  ///< time of the last sample
  // The level at rest above the zero, mN, in the direction of compression:
  Drift rest_;
  bool rest_known_ = false;
  std::chrono::nanoseconds second_began_{0};
  double second_sum_ = 0.0;
  double second_count_ = 0.0;
  bool second_touched_ = false;
  bool rests_ = true;         ///< in the last second
  double second_mean_ = 0.0;  ///< of the last second
  double level_ = 0.0;        ///< of the last second at rest,
  std::chrono::nanoseconds level_time_{0};
  double least_ = std::numeric_limits<double>::infinity();
  int seconds_ = 0;
};

}  // namespace merkel
