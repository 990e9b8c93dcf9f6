#pragma once

#include <cstdint>
#include <string>
#include <thread>

#include "drivers/spike_sink.hpp"
#include "realtime/spike_fanout.hpp"

namespace merkel {

/// The thread of one sink: takes spikes from its queue and writes them. When the sink fails, it
/// takes no more, and every later spike is counted as lost; the other sinks go on.
class SinkWriter {
 public:
  struct Outcome {
    std::uint64_t taken = 0;      ///< spikes taken from the queue
    std::uint64_t delivered = 0;  ///< spikes known to have arrived
    std::string trouble;          ///< empty, or why the sink failed
  };

  SinkWriter(SpikeSink& sink, SpikeChannel& channel);
  SinkWriter(const SinkWriter&) = delete;
  SinkWriter& operator=(const SinkWriter&) = delete;
  ~SinkWriter() = default;

  /// Waits until the last spike is written, and closes the sink; or, where `complete` is false
  /// because the run failed, leaves it unfinished.
  [[nodiscard]] Outcome finish(bool complete);

 private:
  void write_all();

  SpikeSink& sink_;
  SpikeChannel& channel_;
  Outcome outcome_;
  std::jthread thread_;
};

}  // namespace merkel
