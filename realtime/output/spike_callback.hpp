#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <utility>

#include "drivers/sink.hpp"

namespace merkel {

/// A sink that passes records to a function of the program that links merkel. The function runs
/// on the sink's own thread and may block; once the queue is full, only this sink loses records.
class RecordCallback : public Sink {
 public:
  using Function = std::function<void(const RecordBatch&)>;

  /// \param name   its name in the run's report
  /// \param kinds  of the records that it takes (kKinds)
  RecordCallback(std::string name, std::uint32_t kinds, Function function)
      : Sink(std::move(name)), kinds_(kinds), function_(std::move(function)) {}

  [[nodiscard]] std::uint32_t subscriptions() const noexcept override { return kinds_; }
  [[nodiscard]] Expected<void, SinkError> write(const RecordBatch& batch) override {
    function_(batch);
    delivered_ += batch.spikes.size();
    return {};
  }
  [[nodiscard]] Expected<void, SinkError> close() override { return {}; }

 private:
  std::uint32_t kinds_;
  Function function_;
};

/// The same for spikes alone.
class SpikeCallback final : public RecordCallback {
 public:
  using Function = std::function<void(std::span<const SpikeEvent>)>;

  /// \param name  its name in the run's report
  SpikeCallback(std::string name, Function function)
      : RecordCallback(std::move(name), kKinds<SpikeEvent>,
                       [function = std::move(function)](const RecordBatch& batch) {
                         if (!batch.spikes.empty()) function(batch.spikes);
                       }) {}
};

}  // namespace merkel
