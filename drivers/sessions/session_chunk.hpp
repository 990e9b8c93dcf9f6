#pragma once

#include <cstdint>
#include <vector>

#include "core/records/loop_event.hpp"
#include "core/records/probe_sample.hpp"
#include "core/records/run_status.hpp"
#include "core/records/spike_event.hpp"
#include "core/records/stimulation_command.hpp"
#include "core/records/tick_record.hpp"
#include "drivers/raw_frame.hpp"
#include "drivers/run_control.hpp"
#include "drivers/sessions/session_format.hpp"

namespace merkel {

/// The items of one chunk of a session, all of one kind.
struct SessionChunk {
  struct Sample {
    std::uint32_t probe = 0;
    ProbeSample sample;
  };
  struct Frame {
    std::uint32_t probe = 0;
    std::uint32_t port = 0;
    RawFrame frame;
  };
  SessionStream::Id stream = SessionStream::Id::kSpikes;
  std::vector<SpikeEvent> spikes;
  std::vector<TickRecord> ticks;
  std::vector<Sample> samples;
  std::vector<LoopEvent> events;
  std::vector<RunStatus> status;
  std::vector<Frame> frames;
  std::vector<Mark> marks;
  std::vector<StimulationCommand> commands;

  [[nodiscard]] bool empty() const noexcept {
    return spikes.empty() && ticks.empty() && samples.empty() && events.empty() && status.empty() &&
           frames.empty() && marks.empty() && commands.empty();
  }
  void clear() noexcept {
    spikes.clear();
    ticks.clear();
    samples.clear();
    events.clear();
    status.clear();
    frames.clear();
    marks.clear();
    commands.clear();
  }
};

}  // namespace merkel
