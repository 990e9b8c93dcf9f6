#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/encoding/encoded_model.hpp"
#include "core/encoding/field_map.hpp"
#include "core/realtime_tag.hpp"
#include "core/records/spike_event.hpp"

namespace merkel {

/// Activity of the afferents in each electrode's field, over a causal exponential window with time
/// constant τ.
///
/// The mean rate is Σ w·e^{−(t−t_i)/τ} / (τ·N) over the spikes t_i of the field's afferents, with
/// the field's weight w at each afferent and N = Σ w. The share of recruited afferents is
/// Σ w·e^{−(t−t_n)/τ} / N over the last spike t_n of each afferent. A source is an electrode, or a
/// group of electrodes.
/// Real-time: yes, after construction. Deterministic.
class FieldActivity {
 public:
  /// A source whose field contains an afferent.
  struct Membership {
    std::uint32_t source = 0;
    std::uint32_t slot = 0;  ///< index of the pair of afferent and source
  };

  FieldActivity(std::span<const EncoderSource> sources, const EncodedModel& model);

  /// Number of afferents in a source's field.
  [[nodiscard]] std::size_t afferents(std::size_t source) const noexcept {
    return fields_[source].afferents;
  }
  /// The sources whose fields contain the afferent of a spike.
  [[nodiscard]] std::span<const Membership> memberships(const SpikeEvent& spike) const noexcept
      MERKEL_REALTIME;

  void reset() noexcept MERKEL_REALTIME;
  void reset(std::size_t source) noexcept MERKEL_REALTIME;
  /// Advances by a tick that ends at `end`.
  /// \param spikes  of the tick, in order of time
  void advance(std::span<const SpikeEvent> spikes,
               std::chrono::nanoseconds end) noexcept MERKEL_REALTIME;

  /// Mean rate of an afferent of the field, Hz.
  [[nodiscard]] double rate_Hz(std::size_t source) const noexcept MERKEL_REALTIME;
  /// From 0 to 1.
  [[nodiscard]] double recruited_share(std::size_t source) const noexcept MERKEL_REALTIME;

 private:
  struct Field {
    EncoderKind encoder = EncoderKind::kRate;
    double per_ns = 0.0;   ///< 1/τ
    double kept = 0.0;     ///< factor by which the sum decays in a tick
    double sum = 0.0;      ///< Σ e^{−(t−t_i)/τ}
    double decayed = 1.0;  ///< e^{−(t−t0)/τ} since an earlier time t0; weights refer to t0
    std::size_t afferents = 0;
    double total_weight = 0.0;     ///< N
    bool weighted = false;         ///< some weight is not 1
    std::uint32_t first_slot = 0;  ///< the field's slots are consecutive
  };
  void add(const SpikeEvent& spike, std::chrono::nanoseconds end) noexcept;

  std::vector<Field> fields_;
  std::vector<std::size_t> first_membership_;  ///< by afferent over all patches, plus an end entry
  std::vector<Membership> memberships_;
  std::vector<double> map_;  ///< by slot: the field's weight at the afferent
  /// By slot: e^{(t_n−t0)/τ} of an afferent's last spike t_n, or 0. Times `decayed`, it is the
  /// afferent's share in the sum, without another exponential.
  std::vector<double> weights_;
};

}  // namespace merkel
