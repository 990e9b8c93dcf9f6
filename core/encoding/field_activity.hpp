#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/encoding/encoded_model.hpp"
#include "core/encoding/encoding_parameters.hpp"
#include "core/realtime_tag.hpp"
#include "core/records/spike_event.hpp"

namespace merkel {

/// How active the afferents in the field of each electrode are, over a causal exponential window of
/// time constant τ.
///
/// The mean rate is Σ e^{−(t−t_i)/τ} / (τ·N) over the spikes t_i of the field's N afferents. The
/// share of recruited afferents is Σ e^{−(t−t_n)/τ} / N over the afferents' last spikes t_n.
/// Real-time: yes, after construction. Deterministic.
class FieldActivity {
 public:
  /// An electrode whose field an afferent belongs to.
  struct Membership {
    std::uint32_t electrode = 0;
    std::uint32_t slot = 0;  ///< numbers the pairs of afferent and electrode
  };

  FieldActivity(std::span<const Electrode> electrodes, const EncodedModel& model);

  /// Afferents in an electrode's field.
  [[nodiscard]] std::size_t afferents(std::size_t electrode) const noexcept {
    return fields_[electrode].afferents;
  }
  /// The electrodes whose fields hold the afferent of a spike.
  [[nodiscard]] std::span<const Membership> memberships(const SpikeEvent& spike) const noexcept
      MERKEL_REALTIME;

  void reset() noexcept MERKEL_REALTIME;
  void reset(std::size_t electrode) noexcept MERKEL_REALTIME;
  /// Goes on by a tick that ends at `end`. \param spikes  of the tick, in order of time
  void advance(std::span<const SpikeEvent> spikes,
               std::chrono::nanoseconds end) noexcept MERKEL_REALTIME;

  /// Mean rate of an afferent of the field, Hz.
  [[nodiscard]] double rate_Hz(std::size_t electrode) const noexcept MERKEL_REALTIME;
  /// From 0 to 1.
  [[nodiscard]] double recruited_share(std::size_t electrode) const noexcept MERKEL_REALTIME;

 private:
  struct Field {
    EncoderKind encoder = EncoderKind::kRate;
    double per_ns = 0.0;  ///< 1/τ
    double kept = 0.0;    ///< of the sum after a tick
    double sum = 0.0;     ///< of the decayed spikes
    std::size_t afferents = 0;
    std::uint32_t first_slot = 0;  ///< its slots follow one another
  };
  void add(const SpikeEvent& spike, std::chrono::nanoseconds end) noexcept;

  std::vector<Field> fields_;
  std::vector<std::size_t> first_membership_;  ///< by afferent of all patches, and the end
  std::vector<Membership> memberships_;
  std::vector<std::chrono::nanoseconds> last_spike_;  ///< by slot
};

}  // namespace merkel
