#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/realtime_tag.hpp"
#include "core/records/taxel_block.hpp"

namespace merkel {

/// Makes the records of an array's pressures or zeros: of each tick or reading, the blocks that
/// have changed. Real-time: yes, after construction.
template <class Block>
class ChangedTaxels {
 public:
  explicit ChangedTaxels(std::size_t taxels)
      : last_(taxels), changed_((taxels + TaxelBlock::kTaxels - 1) / TaxelBlock::kTaxels) {}

  /// \return valid until the next call
  [[nodiscard]] std::span<const Block> changed(std::span<const float> kPa,
                                               std::chrono::nanoseconds time, std::uint64_t tick,
                                               std::uint32_t probe) noexcept MERKEL_REALTIME {
    std::size_t count = 0;
    for (std::size_t first = 0; first < last_.size(); first += TaxelBlock::kTaxels) {
      const std::size_t size = std::min(TaxelBlock::kTaxels, last_.size() - first);
      const auto now = kPa.subspan(first, size);
      float* const before = last_.data() + first;
      if (std::equal(now.begin(), now.end(), before)) continue;
      std::copy(now.begin(), now.end(), before);
      Block& block = changed_[count++];
      block.time = time;
      block.tick = tick;
      block.probe = probe;
      block.first = static_cast<std::uint16_t>(first);
      block.count = static_cast<std::uint16_t>(size);
      std::copy(now.begin(), now.end(), block.pressure_kPa.begin());
    }
    return {changed_.data(), count};
  }

 private:
  std::vector<float> last_;
  std::vector<Block> changed_;
};

}  // namespace merkel
