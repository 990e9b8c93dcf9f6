#pragma once

#include <span>
#include <vector>

#include "core/encoding/encoding_parameters.hpp"
#include "core/realtime_tag.hpp"

namespace merkel {

/// The field of an electrode or of a group on its patch: discs of skin with weights, each with a
/// diffuse border in which the weight falls linearly to 0. Where discs overlap, the largest weight
/// counts.
class FieldMap {
 public:
  /// The field of one electrode: a disc of weight 1.
  explicit FieldMap(const Electrode& electrode);
  /// The field of a group: its hotspot, or else the fields of its electrodes with their weights.
  FieldMap(const EncodingParameters& parameters, std::size_t group);

  /// The weight at a place, 0 to 1. A place that is not a number lies in every disc, so that the
  /// limiter sees it. Real-time: yes.
  /// \param reach_mm  of a contact around the place
  [[nodiscard]] double weight(double x_mm, double y_mm,
                              double reach_mm = 0.0) const noexcept MERKEL_REALTIME;

 private:
  struct Disc {
    double x_mm, y_mm, radius_mm, weight;
  };
  std::vector<Disc> discs_;
  double border_mm_;
};

/// What determines the drive of one electrode, or of all electrodes of a group.
struct EncoderSource {
  Electrode settings;  ///< of the electrode, or the pattern of the group
  FieldMap map;
};

/// The sources of a scene: in the order of their first electrodes.
struct EncoderSources {
  explicit EncoderSources(const EncodingParameters& parameters);

  std::vector<EncoderSource> sources;
  std::vector<std::size_t> of_electrode;     ///< source of each electrode
  std::vector<std::size_t> first_electrode;  ///< of each source
};

}  // namespace merkel
