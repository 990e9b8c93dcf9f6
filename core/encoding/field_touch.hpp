#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "core/encoding/encoded_model.hpp"
#include "core/encoding/field_map.hpp"
#include "core/encoding/okorokova.hpp"
#include "core/realtime_tag.hpp"
#include "core/records/contact_state.hpp"

namespace merkel {

/// Force and depth of the contacts that reach each field, for the encoders that do not count
/// spikes. In the border of a field, the force counts by the field's weight. Real-time: yes, after
/// construction. Deterministic.
class FieldTouch {
 public:
  FieldTouch(std::span<const EncoderSource> sources, const EncodedModel& model);

  /// Advances a field by a tick.
  /// \param presses  one per probe
  /// \param restarts  whether its history begins with this tick
  void advance(std::size_t source, std::span<const Press> presses,
               bool restarts) noexcept MERKEL_REALTIME;

  /// Of all contacts that reach the field.
  [[nodiscard]] double force_N(std::size_t source) const noexcept MERKEL_REALTIME {
    return force_N_[source];
  }
  /// Mean of the last 33 ms; of the encoder `biomimetic` only.
  [[nodiscard]] double force_rate_N_per_s(std::size_t source) const noexcept MERKEL_REALTIME;
  /// Of the deepest contact, now and 33, 66 and 99 ms before; of the encoder `okorokova` only.
  [[nodiscard]] std::array<double, 4> depths_mm(std::size_t source) const noexcept MERKEL_REALTIME {
    return history_[source].at_intervals();
  }

 private:
  struct OfField {
    FieldMap map;
    std::size_t patch;
    EncoderKind encoder;
  };
  std::vector<OfField> fields_;
  std::vector<std::size_t> patch_of_probe_;
  std::vector<double> force_N_;
  std::vector<TouchHistory> history_;  ///< of the depth; of the force for `biomimetic`
};

}  // namespace merkel
