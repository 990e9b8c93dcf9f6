#include "tools/run/merged_sessions.hpp"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <filesystem>
#include <set>

#include <fmt/core.h>

#include "core/units.hpp"
#include "drivers/sessions/session_reader.hpp"
#include "tools/scene/session_scene.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

/// A session in memory, numbered and timed by itself.
struct OneSession {
  std::string path;
  std::string rig;  ///< the file's name
  std::string boot;
  std::string recorder;  ///< of rigs in one recording of LabRecorder, which have one clock
  std::optional<nanoseconds> clock_error;
  Scene scene;
  RunDescription run;
  RunOrigin origin;
  std::uint32_t neurons = 0;
  bool complete = true;
  RecordLists<RecordVector> items = {};
};

template <class Item>
void append(const std::vector<Item>& from, std::vector<Item>& to) {
  to.insert(to.end(), from.begin(), from.end());
}

/// Of its UTC or, in a recording of LabRecorder, of the recorder's clock.
std::optional<nanoseconds> clock_error_of(const SessionReader& session) {
  const std::string text =
      session.fact(session.fact("recorder").empty() ? "utc_error_ns" : "clock_error_ns");
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || value < 0) return std::nullopt;
  return nanoseconds{value};
}

Expected<OneSession, SetupError> read_session(const std::string& path) {
  auto reader = SessionReader::open(path);
  if (!reader) return Unexpected<SetupError>(reader.error());
  auto scene = scene_of_session(*reader);
  if (!scene) return bad_input(path + ": " + scene.error().sentence);
  const auto model = TactileModel::create(scene->model);
  if (!model) return bad_input(path + ": " + scene->sentence(model.error()));
  auto run = describe_session(path, *reader, &*scene, &*model);
  if (!run) return Unexpected<SetupError>(run.error());
  const auto origin = session_origin(*reader);
  if (!origin) return Unexpected<SetupError>(origin.error());
  OneSession session{.path = path,
                     .rig = reader->fact("rig").empty()
                                ? std::filesystem::path(path).stem().string()
                                : reader->fact("rig"),
                     .boot = reader->fact("boot_id"),
                     .recorder = reader->fact("recorder"),
                     .clock_error = clock_error_of(*reader),
                     .scene = std::move(*scene),
                     .run = std::move(*run),
                     .origin = *origin,
                     .neurons = static_cast<std::uint32_t>(model->neurons())};
  const SessionNumbering numbering(*reader, *model);
  SessionChunk chunk;
  for (;;) {
    const auto more = reader->next(chunk);
    if (!more) return Unexpected<SetupError>(more.error());
    if (!*more) break;
    numbering.apply(chunk);
    for (const SpikeEvent& spike : chunk.spikes) {
      if (spike.neuron >= 1 && spike.neuron <= session.neurons) continue;
      return bad_input(path + " has a spike of neuron " + std::to_string(spike.neuron) +
                       ", which its scene does not have: the session is damaged");
    }
    append(chunk.spikes, session.items.spikes);
    append(chunk.events, session.items.events);
    append(chunk.commands, session.items.commands);
    append(chunk.marks, session.items.marks);
    append(chunk.samples, session.items.samples);
  }
  session.complete = reader->complete();
  return session;
}

std::vector<nanoseconds> marks_of(const OneSession& session, const std::string& label) {
  std::vector<nanoseconds> times;
  for (const Mark& mark : session.items.marks) {
    if (mark.label == label) times.push_back(mark.time);
  }
  return times;
}

std::string labels_of(const OneSession& session) {
  std::set<std::string> labels;
  for (const Mark& mark : session.items.marks) labels.insert(mark.label);
  std::string list;
  for (const std::string& label : labels) list.append(list.empty() ? "" : ", ").append(label);
  return list.empty() ? "it has no marks" : "its marks are " + list;
}

Expected<MergedSessions::Alignment, SetupError> by_mark(const OneSession& first,
                                                        const OneSession& other,
                                                        const std::string& label) {
  const auto here = marks_of(first, label);
  const auto there = marks_of(other, label);
  for (const auto& [session, marks] : {std::pair(&first, &here), std::pair(&other, &there)}) {
    if (marks->empty()) {
      return bad_input(session->path + " has no mark \"" + label + "\": " + labels_of(*session));
    }
  }
  if (here.size() != there.size()) {
    return bad_input(fmt::format(
        "{} has {} marks \"{}\", but {} has {}: the marks of all sessions must be the same events",
        first.path, here.size(), label, other.path, there.size()));
  }
  nanoseconds sum{0};
  for (std::size_t i = 0; i < here.size(); ++i) sum += (here[i] - here[0]) - (there[i] - there[0]);
  const auto count = static_cast<std::int64_t>(here.size());
  MergedSessions::Alignment alignment{.session = other.path,
                                      .offset = here[0] - there[0] + sum / count,
                                      .residual = std::nullopt,
                                      .how = fmt::format("{} marks \"{}\"", count, label)};
  if (count == 1) {
    alignment.how = "one mark \"" + label + "\"";
    return alignment;
  }
  nanoseconds largest{0};
  for (std::size_t i = 0; i < here.size(); ++i) {
    largest = std::max(largest, std::chrono::abs(here[i] - there[i] - alignment.offset));
  }
  alignment.residual = largest;
  return alignment;
}

Expected<MergedSessions::Alignment, SetupError> by_utc(const OneSession& first,
                                                       const OneSession& other) {
  for (const OneSession* const session : {&first, &other}) {
    if (session->origin.utc.count() == 0) {
      return bad_input(session->path +
                       " does not say when it was recorded: align the sessions by a mark that all "
                       "of them have, --by-mark LABEL");
    }
  }
  MergedSessions::Alignment alignment{
      .session = other.path,
      .offset = (first.origin.start - first.origin.utc) - (other.origin.start - other.origin.utc),
      .residual = std::nullopt,
      .how = "UTC of the hosts"};
  if (!first.recorder.empty() && first.recorder == other.recorder) {
    alignment.how = "the same recorder";
    alignment.offset = nanoseconds{0};
    alignment.residual =
        first.clock_error.value_or(nanoseconds{0}) + other.clock_error.value_or(nanoseconds{0});
  } else if (!first.boot.empty() && first.boot == other.boot) {
    alignment.how = "the same host";
    alignment.residual = nanoseconds{0};
  } else if (first.clock_error && other.clock_error) {
    alignment.residual = *first.clock_error + *other.clock_error;
  }
  return alignment;
}

/// Adds a session, with its times moved by `offset` and its numbers after those that are there.
void add(OneSession&& session, nanoseconds offset, MergedSessions& merged) {
  RunDescription& all = merged.run;
  const auto patches = static_cast<std::uint16_t>(all.model.patches.size());
  const auto electrodes = static_cast<std::uint16_t>(all.encoding.electrodes.size());
  for (SpikeEvent spike : session.items.spikes) {
    spike.time += offset;
    spike.neuron += merged.neurons;
    spike.patch = static_cast<std::uint16_t>(spike.patch + patches);
    merged.records.spikes.push_back(spike);
  }
  for (LoopEvent event : session.items.events) {
    event.time += offset;
    event.subject += event.kind == LoopEvent::Kind::kNeuronReset ? merged.neurons : merged.probes;
    merged.records.events.push_back(event);
  }
  for (StimulationCommand command : session.items.commands) {
    command.time += offset;
    command.electrode = static_cast<std::uint16_t>(command.electrode + electrodes);
    merged.records.commands.push_back(command);
  }
  for (const Mark& mark : session.items.marks) {
    merged.records.marks.push_back({mark.time + offset, session.rig + ": " + mark.label});
  }
  for (DeliveredSample item : session.items.samples) {
    item.probe += merged.probes;
    item.sample.time += offset;
    item.sample.arrival += offset;
    merged.records.samples.push_back(item);
  }
  for (PatchParameters patch : session.run.model.patches) {
    patch.name = session.rig + (patch.name.empty() ? "" : "." + patch.name);
    all.model.patches.push_back(std::move(patch));
  }
  for (Indenter indenter : session.run.model.indenters) {
    indenter.patch += patches;
    all.model.indenters.push_back(std::move(indenter));
  }
  for (Electrode electrode : session.run.encoding.electrodes) {
    electrode.patch += patches;
    all.encoding.electrodes.push_back(std::move(electrode));
  }
  append(session.run.probes, all.probes);
  all.facts.emplace_back("merged_session", session.path);
  all.facts.emplace_back("merged_scene", session.run.scene);
  all.facts.emplace_back("merged_offset_ns", std::to_string(offset.count()));
  all.scene += (all.scene.empty() ? "" : " + ") + session.rig;
  merged.neurons += session.neurons;
  merged.probes += static_cast<std::uint32_t>(session.scene.probes.size());
  merged.complete = merged.complete && session.complete;
}

template <class Item>
void sort_by_time(std::vector<Item>& items) {
  std::stable_sort(items.begin(), items.end(),
                   [](const Item& a, const Item& b) { return time_of(a) < time_of(b); });
}

}  // namespace

Expected<MergedSessions, SetupError> merge_sessions(const std::vector<std::string>& paths,
                                                    const std::string& mark) {
  MergedSessions merged;
  std::optional<OneSession> first;  // its items move into the result, its marks and clock stay
  std::set<std::string> rigs;
  for (const std::string& path : paths) {
    auto session = read_session(path);
    if (!session) return Unexpected<SetupError>(session.error());
    const std::string own = session->rig;
    for (int number = 2; !rigs.insert(session->rig).second; ++number) {
      session->rig = own + "_" + std::to_string(number);
    }
    nanoseconds offset{0};
    if (!first) {
      merged.origin = session->origin;
      merged.run.model = session->run.model;
      merged.run.model.patches.clear();
      merged.run.model.indenters.clear();
      merged.run.encoding = session->run.encoding;
      merged.run.encoding.electrodes.clear();
      first.emplace();
      first->path = session->path;
      first->origin = session->origin;
      first->boot = session->boot;
      first->recorder = session->recorder;
      first->clock_error = session->clock_error;
      first->items.marks = session->items.marks;
    } else {
      auto alignment = mark.empty() ? by_utc(*first, *session) : by_mark(*first, *session, mark);
      if (!alignment) return Unexpected<SetupError>(alignment.error());
      offset = alignment->offset;
      merged.alignments.push_back(std::move(*alignment));
    }
    add(std::move(*session), offset, merged);
  }
  RecordLists<RecordVector>& records = merged.records;
  std::stable_sort(records.spikes.begin(), records.spikes.end());
  sort_by_time(records.samples);
  sort_by_time(records.events);
  sort_by_time(records.commands);
  sort_by_time(records.marks);
  return merged;
}

Expected<void, SinkError> write_merged(const MergedSessions& merged, Sink& sink) {
  auto written = sink.begin(merged.origin);
  if (written) written = sink.write(batch_of(merged.records));
  return written ? sink.close() : written;
}

}  // namespace merkel
