#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <utility>

#include "drivers/spike_sink.hpp"

namespace merkel {

/// A sink that hands the spikes to a function of the program that links merkel, on the thread of
/// this sink, in which it may block: that costs its own spikes only, once its queue is full.
class SpikeCallback final : public SpikeSink {
 public:
  using Function = std::function<void(std::span<const SpikeEvent>)>;

  /// \param name  what the run's report calls it
  SpikeCallback(std::string name, Function function)
      : name_(std::move(name)), function_(std::move(function)) {}

  [[nodiscard]] const std::string& uri() const noexcept override { return name_; }
  [[nodiscard]] Expected<void, SinkError> write(std::span<const SpikeEvent> spikes) override {
    function_(spikes);
    delivered_ += spikes.size();
    return {};
  }
  [[nodiscard]] Expected<void, SinkError> close() override { return {}; }
  [[nodiscard]] std::uint64_t delivered() const noexcept override { return delivered_; }

 private:
  std::string name_;
  Function function_;
  std::uint64_t delivered_ = 0;
};

}  // namespace merkel
