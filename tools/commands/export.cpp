#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "drivers/sessions/session_reader.hpp"
#include "drivers/sinks/open_sink.hpp"
#include "tools/commands/command.hpp"
#include "tools/scene/session_scene.hpp"

namespace merkel {
namespace {

struct ExportOptions {
  std::string session;
  std::vector<std::string> sinks;
  std::string time_zero = "session";
  bool overwrite = false;
  bool allow_remote = false;
};

/// Sends a sink the items of a chunk, if it subscribes to them.
Expected<void, SinkError> write_chunk(SpikeSink& sink, const SessionChunk& chunk) {
  if (!chunk.spikes.empty()) {
    return sink.takes_spikes() ? sink.write(chunk.spikes) : Expected<void, SinkError>();
  }
  if (!chunk.commands.empty()) return sink.write_commands(chunk.commands);
  if (!chunk.ticks.empty()) return sink.write_ticks(chunk.ticks);
  if (!chunk.events.empty()) return sink.write_events(chunk.events);
  for (const SessionChunk::Frame& each : chunk.frames) {
    if (auto written = sink.write_frames(each.probe, each.port, {&each.frame, 1}); !written) {
      return written;
    }
  }
  if (!chunk.status.empty()) return sink.write_status(chunk.status.back());
  for (auto first = chunk.samples.begin(); first != chunk.samples.end();) {
    const auto last = std::find_if(first, chunk.samples.end(), [&](const auto& sample) {
      return sample.probe != first->probe;
    });
    std::vector<ProbeSample> samples;
    for (auto each = first; each != last; ++each) samples.push_back(each->sample);
    if (auto written = sink.write_samples(first->probe, samples); !written) return written;
    first = last;
  }
  return {};
}

void print_notice(const std::string& sentence) {
  std::fprintf(stderr, "merkel: %s\n", sentence.c_str());
}

int export_session(const ExportOptions& options) {
  if (options.time_zero != "session" && options.time_zero != "unix" &&
      options.time_zero != "device") {
    return refuse("--time-zero " + options.time_zero + " is not one of session, unix, device");
  }
  auto session = SessionReader::open(options.session);
  if (!session) return refuse(session.error());
  const auto scene = scene_of_session(*session);
  if (!scene) return refuse(scene.error());
  const auto model = TactileModel::create(scene->model);
  if (!model) return refuse(scene->sentence(model.error()));
  const SessionNumbering numbering(*session, *model);
  // The exported file describes the machine and the time of the recording.
  RunDescription run = describe_run(*scene, *model);
  run.facts = session->facts();
  std::erase_if(run.facts, [](const auto& fact) { return fact.first == "scene"; });
  std::vector<std::unique_ptr<SpikeSink>> sinks;
  for (const std::string& uri : options.sinks) {
    auto sink = open_sink(uri, {.neurons = static_cast<std::uint32_t>(model->neurons()),
                                .overwrite = options.overwrite,
                                .allow_remote = options.allow_remote,
                                .run = run,
                                .notice = print_notice,
                                .time_zero = options.time_zero == "unix"     ? TimeZero::kUnix
                                             : options.time_zero == "device" ? TimeZero::kDevice
                                                                             : TimeZero::kRun});
    if (!sink) return refuse(sink.error());
    sinks.push_back(std::move(*sink));
  }
  const auto origin = session_origin(options.session);
  if (!origin) return refuse(origin.error());
  for (const auto& sink : sinks) {
    if (auto started = sink->begin(*origin); !started) return fail(started.error().sentence);
  }
  SessionChunk chunk;
  std::uint64_t spikes = 0;
  for (;;) {
    const auto more = session->next(chunk);
    if (!more) return refuse(more.error());
    if (!*more) break;
    numbering.apply(chunk);
    for (const SpikeEvent& spike : chunk.spikes) {
      if (spike.neuron >= 1 && spike.neuron <= model->neurons()) continue;
      return refuse(options.session + " has a spike of neuron " + std::to_string(spike.neuron) +
                    ", which its scene does not have: the session is damaged");
    }
    for (const StimulationCommand& command : chunk.commands) {
      if (command.electrode < scene->encoding.electrodes.size()) continue;
      return refuse(options.session + " has a command for electrode " +
                    std::to_string(command.electrode + 1) +
                    ", which its scene does not have: the session is damaged");
    }
    spikes += chunk.spikes.size();
    for (const auto& sink : sinks) {
      if (auto written = write_chunk(*sink, chunk); !written) {
        return fail(written.error().sentence);
      }
    }
  }
  for (const auto& sink : sinks) {
    if (auto closed = sink->close(); !closed) return fail(closed.error().sentence);
    if (sink->takes_spikes() && sink->delivered() < spikes) {
      std::fprintf(stderr, "merkel: %s: %llu of %llu spikes did not arrive\n", sink->uri().c_str(),
                   static_cast<unsigned long long>(spikes - sink->delivered()),
                   static_cast<unsigned long long>(spikes));
    }
  }
  std::fprintf(stderr, "%llu spikes exported%s\n", static_cast<unsigned long long>(spikes),
               session->ended_well() ? "" : "; the recording breaks off there");
  return kDone;
}

}  // namespace

void add_export_command(CommandLine& program) {
  auto options = std::make_shared<ExportOptions>();
  program
      .subcommand("export", "Converts a recorded session to other formats with any of the sinks.",
                  "export session.xdf --sink sonata:spikes.h5 --sink csv:spikes.csv")
      .option("session", options->session, "Session, as recorded by --sink xdf:FILE")
      .required()
      .list("--sink", options->sinks, "Sink URI, repeatable: " + sink_schemes())
      .required()
      .option("--time-zero", options->time_zero,
              "Zero of the times in files: session (its start), unix (1970-01-01) or "
              "device (the probe's own time)")
      .flag("--overwrite", options->overwrite, "Replace existing files")
      .flag("--allow-remote", options->allow_remote,
            "Allow sinks to send to other machines and to be reached from them")
      .runs([options] { return export_session(*options); });
}

}  // namespace merkel
