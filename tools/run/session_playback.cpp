#include "tools/run/session_playback.hpp"

#include <algorithm>
#include <thread>
#include <utility>

#include "core/units.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using HostClock = std::chrono::steady_clock;

constexpr milliseconds kStep{10};
constexpr milliseconds kLongestStep{50};  ///< a longer one is a stall of the host

}  // namespace

Expected<void, SinkError> write_samples_of(const SessionChunk& chunk, SpikeSink& sink) {
  std::vector<ProbeSample> samples;
  for (auto first = chunk.samples.begin(); first != chunk.samples.end();) {
    const std::uint32_t probe = first->probe;
    samples.clear();
    for (; first != chunk.samples.end() && first->probe == probe; ++first) {
      samples.push_back(first->sample);
    }
    if (auto written = sink.write_samples(probe, samples); !written) return written;
  }
  return {};
}

Expected<SessionPlayback::Extent, SetupError> SessionPlayback::measure(const std::string& path,
                                                                       nanoseconds tick) {
  auto session = SessionReader::open(path);
  if (!session) return Unexpected<SetupError>(session.error());
  Extent extent;
  SessionChunk chunk;
  for (;;) {
    const auto more = session->next(chunk);
    if (!more) return Unexpected<SetupError>(more.error());
    if (!*more) break;
    if (chunk.ticks.empty()) continue;
    if (extent.ticks == 0) extent.start = chunk.ticks.front().time - tick;
    extent.end = chunk.ticks.back().time;
    extent.ticks += chunk.ticks.size();
  }
  if (extent.ticks == 0 || extent.end <= extent.start) {
    return bad_input(path +
                     " contains no tick inputs: it was recorded without a simulation, or ended "
                     "early");
  }
  return extent;
}

SessionPlayback::SessionPlayback(std::string path, const Extent& extent,
                                 const SessionNumbering& numbering, SessionPosition& position,
                                 std::span<const std::unique_ptr<SpikeSink>> sinks)
    : path_(std::move(path)),
      extent_(extent),
      numbering_(numbering),
      position_(position),
      sinks_(sinks) {}

void SessionPlayback::keep(const Expected<void, SinkError>& result) {
  if (!result && failure_.empty()) failure_ = result.error().sentence;
}

Expected<void, SetupError> SessionPlayback::go_to(nanoseconds place) {
  auto session = SessionReader::open(path_);
  if (!session) return Unexpected<SetupError>(session.error());
  session_.emplace(std::move(*session));
  ended_ = false;
  spikes_.clear();
  ticks_.clear();
  events_.clear();
  marks_.clear();
  commands_.clear();
  switch_off(StimulationCommand::Stop::kGap);
  samples_.clear();
  position_.jumps.fetch_add(1);
  // Skips everything before this position.
  while (!ended_ && (ticks_.empty() || ticks_.back().time < place)) {
    keep_from(place);
    const nanoseconds before = ticks_.empty() ? nanoseconds::min() : ticks_.back().time;
    if (auto read = read_until(before); !read) return read;
  }
  keep_from(place);
  return {};
}

/// Discards everything before a time.
void SessionPlayback::keep_from(nanoseconds time) {
  const auto early = [time](const auto& item) { return item.time < time; };
  std::erase_if(spikes_, early);
  std::erase_if(ticks_, early);
  std::erase_if(events_, early);
  std::erase_if(marks_, early);
  std::erase_if(commands_, early);
  std::erase_if(samples_, [time](const auto& item) { return item.sample.time < time; });
}

/// Reads chunks until one ends after a time, or up to the end of the file.
Expected<void, SetupError> SessionPlayback::read_until(nanoseconds time) {
  while (!ended_ && (ticks_.empty() || ticks_.back().time <= time)) {
    const auto more = session_->next(chunk_);
    if (!more) return Unexpected<SetupError>(more.error());
    if (!*more) {
      ended_ = true;
      break;
    }
    numbering_.apply(chunk_);
    spikes_.insert(spikes_.end(), chunk_.spikes.begin(), chunk_.spikes.end());
    ticks_.insert(ticks_.end(), chunk_.ticks.begin(), chunk_.ticks.end());
    events_.insert(events_.end(), chunk_.events.begin(), chunk_.events.end());
    marks_.insert(marks_.end(), chunk_.marks.begin(), chunk_.marks.end());
    commands_.insert(commands_.end(), chunk_.commands.begin(), chunk_.commands.end());
    samples_.insert(samples_.end(), chunk_.samples.begin(), chunk_.samples.end());
    for (const RunStatus& status : chunk_.status) {
      for (const auto& sink : sinks_) keep(sink->write_status(status));
    }
    if (!chunk_.ticks.empty()) break;
  }
  return {};
}

template <class Item, class Write>
void SessionPlayback::send(std::deque<Item>& waiting, nanoseconds time, const Write& write) {
  std::vector<Item> due;
  while (!waiting.empty() && waiting.front().time <= time) {
    due.push_back(std::move(waiting.front()));
    waiting.pop_front();
  }
  if (due.empty()) return;
  for (const auto& sink : sinks_) keep(write(*sink, std::span<const Item>(due)));
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
  last_commands_.clear();
  if (off.empty()) return;
  for (const auto& sink : sinks_) keep(sink->write_commands(off));
}

void SessionPlayback::send_commands_until(nanoseconds time) {
  for (const StimulationCommand& command : commands_) {
    if (command.time > time) break;
    while (last_commands_.size() <= command.electrode) {
      last_commands_.push_back(command);
      last_commands_.back().electrode = static_cast<std::uint16_t>(last_commands_.size() - 1);
    }
    last_commands_[command.electrode] = command;
  }
  send(commands_, time, [](SpikeSink& sink, auto items) { return sink.write_commands(items); });
}

void SessionPlayback::send_samples_until(nanoseconds time) {
  SessionChunk due;
  while (!samples_.empty() && samples_.front().sample.time <= time) {
    due.samples.push_back(samples_.front());
    samples_.pop_front();
  }
  if (due.samples.empty()) return;
  for (const auto& sink : sinks_) keep(write_samples_of(due, *sink));
}

/// In the order of a run: a tick's spikes and commands before its records.
void SessionPlayback::send_until(nanoseconds time) {
  send(spikes_, time, [](SpikeSink& sink, auto items) {
    return sink.takes_spikes() ? sink.write(items) : Expected<void, SinkError>();
  });
  send_commands_until(time);
  send(ticks_, time, [](SpikeSink& sink, auto items) { return sink.write_ticks(items); });
  send(events_, time, [](SpikeSink& sink, auto items) { return sink.write_events(items); });
  send(marks_, time, [](SpikeSink& sink, auto items) { return sink.write_marks(items); });
  send_samples_until(time);
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
      if (auto read = read_until(place + kStep); !read) return read;
      send_until(place + kStep);
      continue;
    }
    if (position_.paused) switch_off(StimulationCommand::Stop::kGap);
    if (now - last > kLongestStep) {
      // What a stall missed is not sent at once: the playback goes on from where it was.
      switch_off(StimulationCommand::Stop::kGap);
      last = now - kStep;
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
    while (!ended_ && (ticks_.empty() || ticks_.back().time <= place)) {
      if (auto read = read_until(place); !read) return read;
    }
    send_until(place);
    if (!failure_.empty()) return unavailable(failure_);
    std::this_thread::sleep_until(now + kStep);
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
