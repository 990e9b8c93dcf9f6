#include "tools/python/src/session_object.hpp"

#include <algorithm>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <span>

#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "core/units.hpp"
#include "drivers/sessions/session_reader.hpp"
#include "tools/python/src/interpreter_exit.hpp"
#include "tools/python/src/scene_object.hpp"
#include "tools/run/session_alignment.hpp"
#include "tools/scene/session_scene.hpp"

namespace merkel::python {

namespace py = pybind11;

namespace {

/// The samples of a stream of any program.
struct StreamSamples {
  std::vector<double> stamps_s;
  std::string values;
  std::vector<std::string> texts;
};

/// Of each stream its number, header, format, channels, times on the recorder's clock, values
/// (bytes, or a list of the texts) and the residual of its clock.
py::list xdf_streams(const std::filesystem::path& path) {
  std::map<std::uint32_t, XdfStream> streams;
  std::map<std::uint32_t, StreamSamples> samples;
  {
    const GilRelease no_gil;
    XdfFile file =
        or_throw(XdfFile::open(path.string(), std::numeric_limits<std::uint64_t>::max()));
    const auto take = [&](std::uint32_t number, const XdfStream& stream, XdfRow row) {
      StreamSamples& to = samples[number];
      to.stamps_s.push_back(stream.stamp_s);
      if (stream.form.value_bytes > 0) {
        to.values += row.front();
      } else {
        to.texts.insert(to.texts.end(), row.begin(), row.end());
      }
    };
    streams = or_throw(read_xdf_streams(file, take));
  }
  py::list all;
  for (const auto& [number, stream] : streams) {
    const ClockLine line = or_throw(ClockLine::through(stream.offsets, stream.name));
    const StreamSamples& own = samples[number];
    py::array_t<double> time_s(static_cast<py::ssize_t>(own.stamps_s.size()));
    std::transform(own.stamps_s.begin(), own.stamps_s.end(), time_s.mutable_data(), line);
    py::object values = py::bytes(own.values);
    if (stream.form.value_bytes == 0) {
      py::list texts;
      for (const std::string& text : own.texts) texts.append(py::bytes(text));
      values = std::move(texts);
    }
    const double error_s =
        stream.offsets.size() < 2 ? std::numeric_limits<double>::quiet_NaN() : line.residual_s;
    all.append(py::make_tuple(number, py::bytes(stream.header), stream.format, stream.form.channels,
                              time_s, values, error_s));
  }
  return all;
}

}  // namespace

/// The pressures at a tick: those of the tick before, and the blocks that changed.
void SessionObject::add_taxels(const TickRecord& tick, std::deque<TaxelBlock>& blocks) {
  const auto array = taxels.find(tick.probe);
  if (array == taxels.end()) return;
  auto& [count, now, rows] = array->second;
  for (auto block = blocks.begin(); block != blocks.end() && block->tick <= tick.number;) {
    if (block->probe != tick.probe) {
      ++block;
      continue;
    }
    if (block->first + std::size_t{block->count} <= count) {
      std::copy_n(block->pressure_kPa.begin(), block->count, now.begin() + block->first);
    }
    block = blocks.erase(block);
  }
  rows.insert(rows.end(), now.begin(), now.end());
}

SessionObject SessionObject::load(const std::string& path) {
  SessionReader reader = or_throw(SessionReader::open(path));
  SessionObject session;
  session.facts = reader.facts();
  session.origin = or_throw(session_origin(reader));
  std::optional<SessionNumbering> numbering;
  if (!reader.fact("scene_text").empty()) {
    session.scene = or_throw(scene_of_session(reader));
    const auto model = TactileModel::create(session.scene->model);
    if (!model) throw Error(session.scene->sentence(model.error()));
    numbering.emplace(reader, *model);
    session.afferents = afferent_rows(session.scene->model);
    const auto& tips = session.scene->model.indenters;
    for (std::size_t i = 0; i < tips.size(); ++i) {
      const std::size_t count = tips[i].taxels() != nullptr ? tips[i].taxels()->size() : 0;
      if (count == 0) continue;
      session.taxels[static_cast<std::uint32_t>(i)] = {.count = count,
                                                       .now = std::vector<float>(count)};
    }
  }
  const auto zero = session.origin.start;
  for (const std::string& name : reader.extra_columns()) session.extra.emplace_back(name, 0);
  SessionChunk chunk;
  std::deque<TaxelBlock> blocks;
  while (or_throw(reader.next(chunk))) {
    if (numbering) numbering->apply(chunk);
    for (const SpikeEvent& spike : chunk.spikes) session.spikes.push_back(row_of(spike, zero));
    for (const DeliveredSample& item : chunk.samples) {
      session.samples.push_back(row_of_sample(item, zero));
      for (std::size_t k = 0; k < session.extra.size(); ++k) {
        session.extra[k].second.push_back(item.further[k]);
      }
    }
    blocks.insert(blocks.end(), chunk.taxels.begin(), chunk.taxels.end());
    for (const TickRecord& tick : chunk.ticks) {
      session.ticks.push_back(row_of(tick, zero));
      session.add_taxels(tick, blocks);
    }
    for (const LoopEvent& event : chunk.events) session.events.push_back(row_of(event, zero));
    for (const SyncEdge& edge : chunk.edges) session.sync.push_back(row_of(edge, zero));
    for (const StimulationCommand& each : chunk.commands) {
      session.stimulation.push_back(row_of(each, zero));
    }
    for (const Mark& mark : chunk.marks) {
      session.marks.emplace_back(units::s_from(mark.time - zero), mark.label);
    }
  }
  session.complete = reader.complete();
  return session;
}

void add_session(py::module_& module) {
  py::class_<SessionObject>(module, "Session",
                            "A recorded session. Times are in s from the start of the run.")
      .def_property_readonly(
          "spikes", [](const SessionObject& session) { return array_of(session.spikes); },
          "(spikes,) of time_s, neuron, patch and flags, in order of time.")
      .def_property_readonly(
          "samples", [](const SessionObject& session) { return array_of(session.samples); },
          "(samples,) of probe, time_s, arrival_s, depth_mm, force_N, x_mm, y_mm (NaN: not measured), sequence, "
          "channels (bits: 1 depth, 2 force, 4 x, 8 y, 256 zero uncertain, 512 outside calibration) "
          "valid_for_s, zero_N (subtracted from the measured force) and touch (0 undecided, 1 free, 2 touching).")
      .def_property_readonly(
          "extra",
          [](const SessionObject& session) {
            py::dict extra;
            for (const auto& [name, values] : session.extra)
              extra[py::str(name)] = array_of(values);
            return extra;
          },
          "Further columns of the samples, which the model does not use, by name: (samples,); NaN: no number.")
      .def_property_readonly(
          "ticks", [](const SessionObject& session) { return array_of(session.ticks); },
          "(ticks × probes,) of what the loop used: number, probe, time_s (the tick's end), latency_s, "
          "depth_mm, force_N, x_mm, y_mm, late, state (0 following, 1 held, 2 released, 3 ended), delay_s, "
          "doubts (bits: 1 zero uncertain, 2 outside calibration) and touch (0 undecided, 1 free, 2 touching).")
      .def_property_readonly(
          "taxels",
          [](const SessionObject& session) {
            py::dict arrays;
            for (const auto& [probe, array] : session.taxels) {
              const std::size_t rows = array.rows.size() / array.count;
              py::array_t<float> pressures({rows, array.count});
              std::copy(array.rows.begin(), array.rows.end(), pressures.mutable_data());
              arrays[py::int_(probe)] = std::move(pressures);
            }
            return arrays;
          },
          "Pressures of the tactile arrays in kPa, by the number of the probe, from 0: (ticks, taxels).")
      .def_property_readonly(
          "events", [](const SessionObject& session) { return array_of(session.events); },
          "(events,) of time_s, length_s, subject and kind (0 release, 1 resume, 2 gap, 3 neuron reset, 4 zero uncertain, 5 zero certain).")
      .def_property_readonly(
          "afferents", [](const SessionObject& session) { return array_of(session.afferents); },
          "(afferents,) of neuron, patch, x_mm, y_mm, field_radius_mm and receptors.")
      .def_property_readonly(
          "sync", [](const SessionObject& session) { return array_of(session.sync); },
          "(edges,) of the devices' sync lines: time_s, probe (the first that the device feeds), line (from 1) and "
          "level (1: high from here on).")
      .def_property_readonly(
          "stimulation", [](const SessionObject& session) { return array_of(session.stimulation); },
          "(commands,) for the scene's electrodes, as Run.stimulation.")
      .def_readonly("marks", &SessionObject::marks,
                    "[(time_s, label), …]: the marks set by the user.")
      .def_property_readonly(
          "facts",
          [](const SessionObject& session) {
            py::dict facts;
            for (const auto& [name, value] : session.facts) {
              if (!facts.contains(name)) facts[py::str(name)] = value;
            }
            return facts;
          },
          "Metadata of the recording, by name. If a name is repeated, the first value.")
      .def_property_readonly(
          "alignments",
          [](const SessionObject& session) {
            py::dict alignments;
            for (const RecordedAlignment& each : recorded_alignments(session.facts)) {
              // np.interp does not go beyond the points, as ClockMap does.
              constexpr std::chrono::hours kDay{24};
              const ClockMap map(each.points);
              std::vector<ClockReading> all = map.readings();
              const auto first = all.front().from - kDay;
              const auto last = all.back().from + kDay;
              all.insert(all.begin(), {.from = first, .to = map(first)});
              all.push_back({.from = last, .to = map(last)});
              py::array_t<double> points({all.size(), std::size_t{2}});
              auto at = points.mutable_unchecked<2>();
              for (py::ssize_t i = 0; i < at.shape(0); ++i) {
                const ClockReading& point = all[static_cast<std::size_t>(i)];
                at(i, 0) = units::s_from(point.from - session.origin.start);
                at(i, 1) = units::s_from(point.to);
              }
              alignments[py::str(each.to)] = std::move(points);
            }
            return alignments;
          },
          "The alignments that merkel align --sink xdf:FILE has recorded, by the file of the other recorder's pulses: "
          "(points, 2) of time_s here and on the other clock, linear in between, to a day before and after: "
          "np.interp(times_s, *alignment.T) converts times.")
      .def_property_readonly(
          "scene",
          [](const SessionObject& session) {
            if (!session.scene) {
              throw Error(
                  "the session was recorded without a simulation: only sessions of merkel run contain a "
                  "scene");
            }
            return SceneObject(*session.scene);
          },
          "The scene of the recording, seeds included. Raises Error if the session was recorded without a simulation.")
      .def_property_readonly(
          "start_unix_s",
          [](const SessionObject& session) -> std::optional<double> {
            if (session.origin.utc.count() == 0) return std::nullopt;
            return units::s_from(session.origin.utc);
          },
          "The start of the run in s since 1970-01-01 UTC; None if unknown.")
      .def_property_readonly(
          "start_device_s",
          [](const SessionObject& session) { return units::s_from(session.origin.start); },
          "The start of the run in the time of the probe, in s.")
      .def_readonly(
          "complete", &SessionObject::complete,
          "True if the recording is complete; otherwise it is read up to its last complete chunk.");

  module.def("_xdf_streams", &xdf_streams);  // merkel.load_streams presents them
  module.def(
      "load",
      [](const std::filesystem::path& file) {
        const GilRelease no_gil;
        return std::make_unique<SessionObject>(SessionObject::load(file.string()));
      },
      py::arg("file"),
      "Reads a recorded session (.xdf, or .xdf.part of an interrupted run). Raises Error if the file cannot be read.");
}

}  // namespace merkel::python
