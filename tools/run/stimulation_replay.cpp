#include "tools/run/stimulation_replay.hpp"

#include <fmt/core.h>

#include "core/parameters/parameter_error.hpp"
#include "drivers/files/csv_text.hpp"

namespace merkel {

using Stop = StimulationCommand::Stop;

namespace {

std::string sentence_of(const StimulationCommand& command,
                        const std::vector<Electrode>& electrodes) {
  std::string time;
  append_seconds(time, command.time);
  return fmt::format("{} ({}) at {} s, {} uA, {} Hz, heartbeat {}{}{}",
                     command.electrode < electrodes.size() ? electrodes[command.electrode].name
                                                           : "an electrode missing from the scene",
                     name_of(command.kind), time, shortest_decimal(command.amplitude_uA),
                     shortest_decimal(command.frequency_Hz), command.heartbeat,
                     command.stop != Stop::kNone ? ", stopped: " : "", name_of(command.stop));
}

}  // namespace

StimulationReplay::StimulationReplay(StimulationEncoder* encoder)
    : encoder_(encoder),
      comparison_("command", "for", [encoder](const StimulationCommand& command) {
        return sentence_of(command, encoder->parameters().electrodes);
      }) {}

void StimulationReplay::prepare(std::chrono::nanoseconds time) {
  if (encoder_ == nullptr) return;
  last_ = time;
  for (; !drives_.empty() && drives_.front().time <= time; drives_.pop_front()) {
    encoder_->set_drive(drives_.front());
  }
  const auto& recorded = comparison_.remaining();
  if (!recorded.empty() && recorded.front().time == *last_ &&
      recorded.front().stop == Stop::kSinkFailure) {
    encoder_->fail_safe(Stop::kSinkFailure);
  }
}

void StimulationReplay::compare(std::span<const StimulationCommand> commands,
                                const Callback& made) {
  if (encoder_ == nullptr) return;
  comparison_.take(commands);
  if (made) made(commands);
}

void StimulationReplay::finish(const Callback& made) {
  if (encoder_ == nullptr || !last_) return;
  const auto commands = encoder_->finish();
  if (made) made(commands);
  // An interrupted recording has no last update, and may have commands of a missing tick.
  const auto& recorded = comparison_.remaining();
  if (recorded.empty()) return;
  if (recorded.front().stop == Stop::kEnd) {
    comparison_.take(commands);
  } else if (recorded.front().time <= *last_) {
    comparison_.miss();
  }
}

}  // namespace merkel
