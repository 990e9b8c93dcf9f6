#include "tools/run/session_playback.hpp"

#include <algorithm>
#include <thread>
#include <type_traits>
#include <utility>

#include "core/units.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using HostClock = std::chrono::steady_clock;

constexpr milliseconds kStep{10};
constexpr milliseconds kCommandStep{1};  ///< with electrodes: as finely as a run sends commands
constexpr milliseconds kFlushEvery{10};
constexpr milliseconds kMaxStep{50};  ///< a longer one is a stall of the host

/// Records that are played at their time. Status has none, frames have that of another clock, and
/// the player itself sends commands.
template <class Record>
constexpr bool kPlayed = !std::is_same_v<Record, PortFrame> && !std::is_same_v<Record, RunStatus> &&
                         !std::is_same_v<Record, SentCommand>;

}  // namespace

Expected<SessionPlayback::Extent, SetupError> SessionPlayback::measure(const std::string& path,
                                                                       nanoseconds tick) {
  auto session = SessionReader::open(path);
  if (!session) return Unexpected<SetupError>(session.error());
  Extent extent;
  const auto read = session->for_each([&](const SessionChunk& chunk) {
    if (chunk.ticks.empty()) return;
    if (extent.ticks == 0) extent.start = chunk.ticks.front().time - tick;
    extent.end = chunk.ticks.back().time;
    extent.ticks += chunk.ticks.size();
  });
  if (!read) return Unexpected<SetupError>(read.error());
  if (extent.ticks == 0 || extent.end <= extent.start) {
    return bad_input(path +
                     " contains no tick inputs: it was recorded without a simulation, or ended "
                     "early");
  }
  return extent;
}

SessionPlayback::SessionPlayback(std::string path, const Extent& extent,
                                 const SessionNumbering& numbering, const Scene& scene,
                                 SessionPosition& position,
                                 std::span<const std::unique_ptr<Sink>> sinks)
    : path_(std::move(path)),
      extent_(extent),
      numbering_(numbering),
      position_(position),
      sinks_(sinks),
      electrodes_(scene.encoding.electrodes.size()),
      step_(electrodes_ == 0 ? kStep : kCommandStep) {
  if (electrodes_ > 0) gate_.emplace(scene.encoding, scene.model.tick);
  for (const auto& sink : sinks) {
    outlets_.emplace_back();
    if (gate_ && sink->receives_commands()) outlets_.back().emplace(scene.encoding);
  }
}

void SessionPlayback::keep(const Expected<void, SinkError>& result) {
  if (!result && failure_.empty()) failure_ = result.error().sentence;
}

Expected<void, SetupError> SessionPlayback::go_to(nanoseconds place) {
  auto session = SessionReader::open(path_);
  if (!session) return Unexpected<SetupError>(session.error());
  session_.emplace(std::move(*session));
  ended_ = false;
  clear_all(waiting_);
  passed_taxels_.clear();
  switch_off(StimulationCommand::Stop::kGap);
  if (gate_) gate_->jump();
  position_.jumps.fetch_add(1);
  // Skips everything before this position.
  while (!ended_ && (waiting_.ticks.empty() || waiting_.ticks.back().time < place)) {
    keep_from(place);
    const nanoseconds before =
        waiting_.ticks.empty() ? nanoseconds::min() : waiting_.ticks.back().time;
    if (auto read = read_until(before); !read) return read;
  }
  keep_from(place);
  restore_taxels();
  return {};
}

/// The pressures of tactile arrays at the new position, where their blocks did not change.
void SessionPlayback::restore_taxels() {
  auto& blocks = waiting_.of<TaxelBlock>();
  for (auto& [place, block] : std::exchange(passed_taxels_, {})) {
    if (waiting_.ticks.empty()) continue;
    block.time = waiting_.ticks.front().time;
    block.tick = waiting_.ticks.front().number;
    blocks.push_front(block);
  }
}

/// Discards everything before a time.
void SessionPlayback::keep_from(nanoseconds time) {
  for (const TaxelBlock& block : waiting_.of<TaxelBlock>()) {
    if (block.time < time) passed_taxels_[{block.probe, block.first}] = block;
  }
  for_each_kind(waiting_, [time]<class Record>(std::deque<Record>& list) {
    if constexpr (kPlayed<Record>) {
      std::erase_if(list, [time](const Record& record) { return time_of(record) < time; });
    }
  });
}

/// Reads chunks until one ends after a time, or up to the end of the file.
Expected<void, SetupError> SessionPlayback::read_until(nanoseconds time) {
  while (!ended_ && (waiting_.ticks.empty() || waiting_.ticks.back().time <= time)) {
    const auto more = session_->next(chunk_);
    if (!more) return Unexpected<SetupError>(more.error());
    if (!*more) {
      ended_ = true;
      break;
    }
    numbering_.apply(chunk_);
    send({.status = chunk_.status});
    for_each_kind(chunk_, [this]<class Record>(const std::vector<Record>& list) {
      if constexpr (kPlayed<Record>) {
        waiting_.of<Record>().insert(waiting_.of<Record>().end(), list.begin(), list.end());
      }
    });
    if (!chunk_.ticks.empty()) break;
  }
  return {};
}

void SessionPlayback::send(const RecordBatch& batch) {
  if (count_of(batch) == 0) return;
  for (std::size_t i = 0; i < sinks_.size(); ++i) {
    RecordBatch own = batch;
    if (outlets_[i]) own.sent = outlets_[i]->pass(batch.sent, HostClock::now().time_since_epoch());
    keep(sinks_[i]->write(own));
    if (sinks_[i]->interrupted() && outlets_[i]) outlets_[i]->lose();
  }
}

/// Commands leave through the gate. It is asked also if there are none: it is the watchdog.
void SessionPlayback::send_commands(std::span<const StimulationCommand> commands,
                                    nanoseconds place) {
  const nanoseconds now = HostClock::now().time_since_epoch();
  if (!gate_ || (commands.empty() && last_commands_.empty())) return;  // all is off
  const StimulationSwitch::State by_hand = position_.stimulation.state();
  const auto sent = gate_->pass(commands, {.now = now,
                                           .wall_offset = now - place,
                                           .delay = step_,
                                           .last_tick = now,
                                           .stopped = by_hand.by != StimulationSwitch::By::kNone,
                                           .stops = by_hand.stops});
  send({.commands = commands, .sent = sent});
}

/// Whenever there is a gap in the recorded commands, a receiver must not continue
/// with the last one.
void SessionPlayback::switch_off(StimulationCommand::Stop stop) {
  std::vector<StimulationCommand> off;
  for (StimulationCommand command : last_commands_) {
    command.kind = StimulationCommand::Kind::kUpdate;
    command.amplitude_uA = command.frequency_Hz = 0.0;
    command.stop = stop;
    off.push_back(command);
  }
  if (last_commands_.empty()) return;
  last_commands_.clear();
  send_commands(off, off.front().time);
}

void SessionPlayback::send_until(nanoseconds time) {
  RecordLists<RecordVector> due;
  for_each_kind(waiting_, [&]<class Record>(std::deque<Record>& list) {
    if constexpr (kPlayed<Record>) {
      while (!list.empty() && time_of(list.front()) <= time) {
        due.of<Record>().push_back(std::move(list.front()));
        list.pop_front();
      }
    }
  });
  for (const StimulationCommand& command : due.commands) {
    if (command.electrode >= electrodes_) continue;
    if (last_commands_.empty()) last_commands_.assign(electrodes_, command);
    for (std::size_t e = 0; e < electrodes_; ++e) {
      last_commands_[e].electrode = static_cast<std::uint16_t>(e);
      last_commands_[e].time = command.time;
    }
    last_commands_[command.electrode] = command;
  }
  RecordBatch batch = batch_of(due);
  batch.commands = {};
  send(batch);
  send_commands(due.commands, std::min(time, extent_.end));
  const nanoseconds now = HostClock::now().time_since_epoch();
  if (now < next_flush_) return;
  next_flush_ = now + kFlushEvery;
  for (const auto& sink : sinks_) keep(sink->flush());
}

Expected<void, SetupError> SessionPlayback::play(nanoseconds from, bool wait_at_end,
                                                 const std::atomic<bool>& stop) {
  nanoseconds place = std::clamp(from, extent_.start, extent_.end);
  if (auto gone = go_to(place); !gone) return gone;
  auto last = HostClock::now();
  bool at_end = false;
  while (!stop.load(std::memory_order_relaxed)) {
    const auto now = HostClock::now();
    const double wanted_s = position_.seek_s.exchange(-1.0);
    if (wanted_s >= 0.0) {
      place = extent_.start + units::nanoseconds_from_s(std::min(wanted_s, position_.length_s));
      if (auto gone = go_to(place); !gone) return gone;
      last = HostClock::now();
      at_end = false;
      // While paused, read a step at the new position.
      if (auto read = read_until(place + step_); !read) return read;
      send_until(place + step_);
      continue;
    }
    if (position_.paused) switch_off(StimulationCommand::Stop::kGap);
    if (now - last > kMaxStep) {
      // What a stall missed is not sent at once: the playback goes on from where it was.
      switch_off(StimulationCommand::Stop::kGap);
      last = now - step_;
    }
    if (!position_.paused && place < extent_.end) place += now - last;
    last = now;
    if (place >= extent_.end) {
      if (!wait_at_end) break;
      // Resuming at the end starts again from the beginning.
      if (std::exchange(at_end, true) && !position_.paused) {
        position_.seek_s.store(0.0);
        at_end = false;
        continue;
      }
      position_.paused.store(true);
    }
    while (!ended_ && (waiting_.ticks.empty() || waiting_.ticks.back().time <= place)) {
      if (auto read = read_until(place); !read) return read;
    }
    send_until(place);
    if (!failure_.empty()) return unavailable(failure_);
    std::this_thread::sleep_until(now + step_);
  }
  if (place >= extent_.end) {
    // The last update of a run follows its last tick.
    while (!ended_) {
      if (auto read = read_until(nanoseconds::max()); !read) return read;
    }
    send_until(nanoseconds::max());
  } else {
    switch_off(StimulationCommand::Stop::kEnd);
  }
  return {};
}

}  // namespace merkel
