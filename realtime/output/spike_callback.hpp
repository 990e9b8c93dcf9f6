#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <utility>

#include "drivers/sink.hpp"

namespace merkel {

/// A sink that passes the spikes to a function of the program that links merkel. The function runs
/// on the sink's own thread and may block; once the queue is full, only this sink loses spikes.
class SpikeCallback final : public Sink {
 public:
  using Function = std::function<void(std::span<const SpikeEvent>)>;

  /// \param name  its name in the run's report
  SpikeCallback(std::string name, Function function)
      : Sink(std::move(name)), function_(std::move(function)) {}

  [[nodiscard]] Expected<void, SinkError> write(const RecordBatch& batch) override {
    if (!batch.spikes.empty()) function_(batch.spikes);
    delivered_ += batch.spikes.size();
    return {};
  }
  [[nodiscard]] Expected<void, SinkError> close() override { return {}; }

 private:
  Function function_;
};

}  // namespace merkel
