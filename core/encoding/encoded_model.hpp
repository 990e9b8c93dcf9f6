#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <vector>

#include "core/receptors/patch.hpp"
#include "core/scene/tactile_model.hpp"

namespace merkel {

/// What an encoder must know of the model whose touch it encodes.
struct EncodedModel {
  struct Point {
    double x_mm = 0.0;
    double y_mm = 0.0;
  };
  struct OfPatch {
    Patch area;
    /// Where each afferent's receptive field is; nothing of an afferent without receptors.
    std::vector<std::optional<Point>> afferents;
  };

  std::chrono::nanoseconds tick{1'000'000};
  std::size_t most_spikes = 40;  ///< of an afferent in a tick: one a membrane step
  std::vector<OfPatch> patches;
  std::vector<std::size_t> patch_of_probe;
};

/// The place of an afferent is the mean of its receptors. Real-time: no.
[[nodiscard]] EncodedModel encoded_model(const TactileModel& model);

}  // namespace merkel
