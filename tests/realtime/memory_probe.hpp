#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "drivers/probe.hpp"

namespace merkel {

/// A recording in memory, delivered in chunks.
class MemoryProbe final : public Probe {
 public:
  MemoryProbe(std::vector<ProbeSample> samples, std::size_t chunk, std::string error_message = {})
      : samples_(std::move(samples)), chunk_(chunk), error_message_(std::move(error_message)) {
    info_.uri = "memory:";
    info_.channels = ProbeSample::kDepth;
    info_.period = std::chrono::milliseconds{1};
    info_.replayed = true;
  }
  /// What status() returns.
  void counts(const DeviceCounts& counts) { counts_ = counts; }
  [[nodiscard]] ProbeStatus status() const override { return {.device = counts_}; }
  /// Delivers at most `samples` samples until `until` returns true.
  void wait_after(std::size_t samples, std::function<bool()> until) {
    wait_after_ = samples;
    until_ = std::move(until);
  }
  [[nodiscard]] std::span<const ProbeInfo> outputs() const noexcept override { return {&info_, 1}; }
  Expected<std::size_t, ProbeError> read(Readings& readings, std::chrono::milliseconds) override {
    readings.clear();
    if (until_ && next_ >= wait_after_ && !until_()) {
      std::this_thread::sleep_for(std::chrono::milliseconds{1});
      return 0;
    }
    const std::size_t count = std::min({chunk_, readings.room(), samples_.size() - next_});
    for (std::size_t i = 0; i < count; ++i) readings.add_sample(samples_[next_++]);
    if (count > 0) return count;
    return Unexpected<ProbeError>(error_message_.empty() ? ProbeError::kEndOfStream
                                                         : ProbeError::kBadData);
  }
  [[nodiscard]] std::string error_message() const override { return error_message_; }

 private:
  std::vector<ProbeSample> samples_;
  std::size_t chunk_;
  std::size_t next_ = 0;
  std::string error_message_;
  std::size_t wait_after_ = 0;
  std::function<bool()> until_;
  std::optional<DeviceCounts> counts_;
  ProbeInfo info_;
};

}  // namespace merkel
