#include "tools/run/recorded_session.hpp"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <limits>
#include <utility>
#include <vector>

#include "drivers/sessions/afferent_table.hpp"

namespace merkel {

Expected<std::unique_ptr<RecordedSession>, SetupError> RecordedSession::open(
    const std::string& path) {
  auto reader = SessionReader::open(path);
  if (!reader) return Unexpected<SetupError>(reader.error());
  std::unique_ptr<RecordedSession> session(new RecordedSession);
  session->path_ = path;
  if (!reader->fact("scene_text").empty()) {
    auto scene = scene_of_session(*reader);
    if (!scene) return bad_input(path + ": " + scene.error().sentence);
    const auto afferents = afferents_of(scene->model);
    if (!afferents) return bad_input(path + ": " + scene->sentence(afferents.error()));
    session->neurons_ = static_cast<std::uint32_t>(afferents->size());
    if (SessionNumbering::needed(*reader)) {
      const auto model = TactileModel::create(scene->model);
      if (!model) return bad_input(path + ": " + scene->sentence(model.error()));
      session->numbering_.emplace(*reader, *model);
    }
    session->scene_ = std::move(*scene);
  }
  auto run = describe_session(path, *reader, session->scene_ ? &*session->scene_ : nullptr);
  if (!run) return Unexpected<SetupError>(run.error());
  session->run_ = std::move(*run);
  const auto origin = session_origin(*reader);
  if (!origin) return Unexpected<SetupError>(origin.error());
  session->origin_ = *origin;
  return session;
}

void RecordedSession::set_clock(const ClockMap& clock) {
  clock_ = clock_.then(clock);
  origin_.start = clock(origin_.start);
}

namespace {

template <class Record>
void convert(Record& record, const ClockMap& clock) {
  if constexpr (std::is_same_v<Record, RunStatus>) {
    return;
  } else if constexpr (std::is_same_v<Record, PortFrame>) {
    record.frame.time = clock(record.frame.time);
  } else if constexpr (std::is_same_v<Record, DeliveredSample>) {
    record.sample.time = clock(record.sample.time);
    record.sample.arrival = clock(record.sample.arrival);
  } else if constexpr (std::is_same_v<Record, SentCommand>) {
    record.command.time = clock(record.command.time);  // the others stay those of its host
  } else {
    if constexpr (std::is_same_v<Record, LoopEvent>) {
      record.length = clock(record.time + record.length) - clock(record.time);
    }
    record.time = clock(record.time);
  }
}

}  // namespace

Expected<bool, SetupError> RecordedSession::next(SessionReader& reader, SessionChunk& chunk) const {
  auto more = reader.next(chunk);
  if (!more || !*more) return more;
  if (numbering_) numbering_->apply(chunk);
  for_each_kind(static_cast<RecordLists<RecordVector>&>(chunk), [&](auto& list) {
    for (auto& record : list) convert(record, clock_);
  });
  for (const SpikeEvent& spike : chunk.spikes) {
    if (spike.neuron >= 1 && spike.neuron <= neurons_) continue;
    return bad_input(path_ + " has a spike of neuron " + std::to_string(spike.neuron) +
                     ", which its scene does not have: the session is damaged");
  }
  const std::size_t electrodes = scene_ ? scene_->encoding.electrodes.size() : 0;
  std::vector<std::uint16_t> of_commands;
  for (const StimulationCommand& command : chunk.commands) of_commands.push_back(command.electrode);
  for (const SentCommand& item : chunk.sent) of_commands.push_back(item.command.electrode);
  for (const std::uint16_t electrode : of_commands) {
    if (electrode < electrodes) continue;
    return bad_input(path_ + " has a command for electrode " + std::to_string(electrode + 1) +
                     ", which its scene does not have: the session is damaged");
  }
  return more;
}

Expected<void, std::string> RecordedSession::read(const Take& take) {
  auto session = reader();
  if (!session) return Unexpected<std::string>(session.error().sentence);
  SessionChunk chunk;
  for (;;) {
    const auto more = next(*session, chunk);
    if (!more) return Unexpected<std::string>(more.error().sentence);
    if (!*more || !take(batch_of(chunk))) break;
  }
  complete_ = session->complete();
  clock_readings_ = session->clock_readings();
  for (ClockReading& each : clock_readings_) each.from = clock_(each.from);
  return {};
}

namespace {

Expected<bool, std::string> holds_sent(RunJournal& run) {
  bool found = false;
  auto looked = run.read([&](const RecordBatch& batch) {
    found = !batch.sent.empty();
    return !found;
  });
  if (!looked) return Unexpected<std::string>(looked.error());
  return found;
}

/// Of each electrode, whether the session of its run holds what left.
Expected<std::vector<bool>, std::string> electrodes_with_sent(RunJournal& run) {
  constexpr std::size_t kAll = std::numeric_limits<std::uint16_t>::max() + 1U;
  std::vector<RunJournal::Part> parts = run.parts();
  if (parts.empty()) parts.push_back({.journal = run, .electrodes = kAll});
  std::vector<bool> with_sent;
  for (const RunJournal::Part& part : parts) {
    const auto holds = holds_sent(part.journal);
    if (!holds) return Unexpected<std::string>(holds.error());
    with_sent.insert(with_sent.end(), part.electrodes, *holds);
  }
  return with_sent;
}

/// What left; of an electrode whose session does not hold it, what the encoder commanded.
std::vector<SentCommand> for_receivers(const RecordBatch& batch,
                                       const std::vector<bool>& with_sent) {
  std::vector<SentCommand> left = unsent_of(batch.commands);
  std::erase_if(left, [&](const SentCommand& each) {
    return each.command.electrode < with_sent.size() && with_sent[each.command.electrode];
  });
  std::copy_if(batch.sent.begin(), batch.sent.end(), std::back_inserter(left),
               [](const SentCommand& each) { return each.refused_by == 0; });
  std::ranges::stable_sort(left, {}, [](const SentCommand& each) { return time_of(each); });
  return left;
}

}  // namespace

Expected<void, SetupError> write_run(RunJournal& run, const RunOrigin& origin,
                                     std::span<const std::unique_ptr<Sink>> sinks,
                                     std::uint64_t& spikes) {
  std::string failure;
  const auto keep = [&](const Expected<void, SinkError>& result) {
    if (!result && failure.empty()) failure = result.error().sentence;
    return failure.empty();
  };
  for (const auto& sink : sinks) {
    if (!keep(sink->begin(origin))) return unavailable(failure);
  }
  const bool receives = std::any_of(sinks.begin(), sinks.end(),
                                    [](const auto& sink) { return sink->receives_commands(); });
  std::vector<bool> with_sent;
  if (receives) {
    auto found = electrodes_with_sent(run);
    if (!found) return bad_input(found.error());
    with_sent = std::move(*found);
  }
  const auto read = run.read([&](const RecordBatch& batch) {
    spikes += batch.spikes.size();
    const auto left = receives ? for_receivers(batch, with_sent) : std::vector<SentCommand>();
    RecordBatch received = batch;
    received.sent = left;
    return std::all_of(sinks.begin(), sinks.end(), [&](const auto& sink) {
      return keep(sink->write(sink->receives_commands() ? received : batch));
    });
  });
  if (!read) return bad_input(read.error());
  for (const auto& sink : sinks) {
    if (failure.empty()) keep(sink->close());
  }
  if (!failure.empty()) return unavailable(failure);
  return {};
}

}  // namespace merkel
