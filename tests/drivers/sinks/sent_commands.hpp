#pragma once

#include <chrono>
#include <vector>

#include "drivers/sink_setup.hpp"

namespace merkel {

/// Two electrodes, with a watchdog of 200 ms.
inline SinkSetup stim_setup() {
  SinkSetup setup{.neurons = 20, .run = {}};
  for (const char* const name : {"E1", "E2"}) {
    Electrode electrode{.name = name};
    electrode.amplitude_uA = {20.0, 80.0};
    electrode.frequency_Hz = {0.0, 200.0};
    setup.run.encoding.electrodes.push_back(electrode);
  }
  setup.run.encoding.stimulation.watchdog = std::chrono::milliseconds{200};
  return setup;
}

/// A pulse of the second electrode and an update of both.
inline std::vector<SentCommand> commands() {
  const std::vector<StimulationCommand> all = {{.time = std::chrono::nanoseconds{3'200'001},
                                                .amplitude_uA = 80.0,
                                                .electrode = 1,
                                                .kind = StimulationCommand::Kind::kPulse},
                                               {.time = std::chrono::milliseconds{10},
                                                .amplitude_uA = 1.0 / 3.0,
                                                .frequency_Hz = 55.5,
                                                .heartbeat = 1},
                                               {.time = std::chrono::milliseconds{10},
                                                .heartbeat = 1,
                                                .electrode = 1,
                                                .stop = StimulationCommand::Stop::kGap}};
  std::vector<SentCommand> sent;
  for (const StimulationCommand& each : all) {
    sent.push_back({.command = each,
                    .sent = std::chrono::milliseconds{500},
                    .valid_until = std::chrono::milliseconds{560}});
  }
  return sent;
}

}  // namespace merkel
