#pragma once

#include <chrono>
#include <cstddef>
#include <vector>

#include "core/receptors/patch.hpp"
#include "core/scene/patch_layout.hpp"
#include "core/scene/tactile_model.hpp"

namespace merkel {

/// The facts about a model that an encoder needs.
struct EncodedModel {
  struct OfPatch {
    Patch area;
    std::vector<AfferentSite> afferents;
    bool array = false;  ///< a tactile array presses on it, without a depth
  };

  std::chrono::nanoseconds tick{1'000'000};
  std::size_t most_spikes = 40;  ///< of an afferent in a tick: one per membrane step
  std::vector<OfPatch> patches;
  std::vector<std::size_t> patch_of_probe;
};

/// The encoder's view of a model. Real-time: no.
[[nodiscard]] EncodedModel encoded_model(const TactileModel& model);

}  // namespace merkel
