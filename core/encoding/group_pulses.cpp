#include "core/encoding/group_pulses.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace merkel {

using std::chrono::nanoseconds;

GroupPulses::GroupPulses(const EncodingParameters& parameters)
    : groups_(parameters.groups.size()), amplitude_uA_(parameters.electrodes.size()) {
  for (std::size_t e = 0; e < parameters.electrodes.size(); ++e) {
    const auto& group = parameters.electrodes[e].group;
    if (!group) continue;
    groups_[*group].patch = parameters.electrodes[e].patch;
    groups_[*group].electrodes.push_back(static_cast<std::uint16_t>(e));
  }
}

void GroupPulses::reset() noexcept {
  for (Group& group : groups_) {
    group.turn = 0;
    group.interval.reset();
    group.last.reset();
  }
}

void GroupPulses::take(std::span<StimulationCommand> update) noexcept {
  for (Group& group : groups_) {
    group.interval.reset();
    for (const std::uint16_t electrode : group.electrodes) {
      StimulationCommand& train = update[electrode];
      amplitude_uA_[electrode] = train.amplitude_uA;
      if (!std::isfinite(train.amplitude_uA) || !std::isfinite(train.frequency_Hz)) {
        amplitude_uA_[electrode] = 0.0;
        continue;
      }
      if (train.frequency_Hz > 0.0) {
        const double pulses_per_s =
            train.frequency_Hz * static_cast<double>(group.electrodes.size());
        group.interval = nanoseconds{static_cast<std::int64_t>(std::ceil(1e9 / pulses_per_s))};
      }
      train.amplitude_uA = train.frequency_Hz = 0.0;
    }
  }
}

void GroupPulses::stop(std::span<const StimulationCommand::Stop> stops) noexcept {
  for (Group& group : groups_) {
    if (stops[group.patch] != StimulationCommand::Stop::kNone) group.interval.reset();
  }
}

std::size_t GroupPulses::append(std::span<StimulationCommand> commands, std::size_t count,
                                nanoseconds begin, nanoseconds end,
                                std::uint32_t heartbeat) noexcept {
  const std::size_t before = count;
  for (Group& group : groups_) {
    if (!group.interval) continue;
    const nanoseconds earliest = begin + nanoseconds{1};
    const nanoseconds time =
        group.last ? std::max(earliest, *group.last + *group.interval) : earliest;
    if (time > end) continue;
    const std::uint16_t electrode = group.electrodes[group.turn];
    group.turn = (group.turn + 1) % group.electrodes.size();
    group.last = time;
    commands[count++] = {.time = time,
                         .amplitude_uA = amplitude_uA_[electrode],
                         .heartbeat = heartbeat,
                         .electrode = electrode,
                         .kind = StimulationCommand::Kind::kPulse};
  }
  if (count > before) {
    std::sort(commands.begin(), commands.begin() + static_cast<std::ptrdiff_t>(count),
              [](const StimulationCommand& a, const StimulationCommand& b) {
                return std::pair(a.time, a.electrode) < std::pair(b.time, b.electrode);
              });
  }
  return count;
}

}  // namespace merkel
