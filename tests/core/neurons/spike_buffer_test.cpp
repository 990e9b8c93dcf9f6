#include "core/neurons/spike_buffer.hpp"

#include <gtest/gtest.h>

namespace merkel {
namespace {

TEST(SpikeBuffer, CountsWhatItHasNoRoomForAndWhatOthersHadNone) {
  SpikeBuffer patch(2);
  SpikeBuffer all(10);
  for (int tick = 1; tick <= 3; ++tick) {
    patch.clear();
    all.clear();
    for (std::uint32_t neuron = 1; neuron <= 3; ++neuron) patch.push({.neuron = neuron});
    all.append(patch);
    EXPECT_EQ(all.events().size(), 2U);
    EXPECT_EQ(all.refused(), static_cast<std::uint64_t>(tick));
  }
}

}  // namespace
}  // namespace merkel
