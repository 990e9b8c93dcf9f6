#include "tools/run/stimulation_replay.hpp"

#include "core/parameters/parameter_error.hpp"
#include "drivers/files/csv_text.hpp"

namespace merkel {

using Stop = StimulationCommand::Stop;

std::string StimulationReplay::sentence_of(const StimulationCommand& command) const {
  const auto& electrodes = encoder_->parameters().electrodes;
  std::string text = command.electrode < electrodes.size() ? electrodes[command.electrode].name
                                                           : "an electrode missing from the scene";
  text.append(" (").append(name_of(command.kind)).append(") at ");
  append_seconds(text, command.time);
  text += " s, " + shortest_decimal(command.amplitude_uA) + " uA, " +
          shortest_decimal(command.frequency_Hz) + " Hz, heartbeat " +
          std::to_string(command.heartbeat);
  if (command.stop != Stop::kNone) text.append(", stopped: ").append(name_of(command.stop));
  return text;
}

void StimulationReplay::compare(std::span<const StimulationCommand> commands) {
  for (const StimulationCommand& command : commands) {
    ++commands_;
    if (!difference_.empty()) continue;
    if (recorded_.empty()) {
      difference_ =
          "the replay has a command for " + sentence_of(command) + ", the recording has none";
    } else if (recorded_.front() != command) {
      difference_ = "the replay has a command for " + sentence_of(command) +
                    ", the recording one for " + sentence_of(recorded_.front());
    } else {
      recorded_.pop_front();
    }
  }
}

void StimulationReplay::step(std::span<const TickRecord> records,
                             std::span<const SpikeEvent> spikes, const TactileModel& model,
                             const Made& made) {
  if (encoder_ == nullptr) return;
  last_ = records.front().time;
  if (!recorded_.empty() && recorded_.front().time == *last_ &&
      recorded_.front().stop == Stop::kSinkFailure) {
    encoder_->fail_safe(Stop::kSinkFailure);
  }
  const auto commands = encoder_->step(
      {.records = records, .presses = model.presses(), .spikes = spikes, .resets = model.resets()});
  compare(commands);
  if (made) made(commands);
}

void StimulationReplay::finish(const Made& made) {
  if (encoder_ == nullptr || !last_) return;
  const auto commands = encoder_->finish();
  if (made) made(commands);
  // An interrupted recording has no last update, and may have commands of a missing tick.
  if (recorded_.empty()) return;
  if (recorded_.front().stop == Stop::kEnd) {
    compare(commands);
  } else if (recorded_.front().time <= *last_ && difference_.empty()) {
    difference_ = "the recording has a command for " + sentence_of(recorded_.front()) +
                  ", the replay has none";
  }
}

}  // namespace merkel
