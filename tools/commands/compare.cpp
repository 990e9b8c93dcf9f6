#include <cstdio>
#include <memory>
#include <optional>
#include <string>

#include <fmt/core.h>

#include "core/units.hpp"
#include "drivers/sessions/session_samples.hpp"
#include "drivers/spike_files/spike_file.hpp"
#include "tools/commands/command.hpp"
#include "tools/commands/compare_list.hpp"
#include "tools/commands/compare_match.hpp"
#include "tools/commands/compare_stimulation.hpp"
#include "tools/json_text.hpp"

namespace merkel {
namespace {

struct CompareOptions {
  std::string a;
  std::string b;
  double within_us = 1.0;
  double within_uA = 0.0;
  double within_Hz = 0.0;
  bool json = false;
};

/// The comparison of two files: of spikes, of stimulation commands, or of both.
struct Comparison {
  std::optional<Matching<RecordedSpike>> spikes;
  std::optional<StimulationComparison> commands;

  [[nodiscard]] bool equal() const noexcept {
    return (!spikes || spikes->complete()) && (!commands || commands->equal());
  }
};

void note_unknown_start(const CompareOptions& options, bool a_known, bool b_known) {
  if (a_known == b_known) return;
  std::fprintf(stderr,
               "merkel: note: %s does not record when its run started: its times are compared "
               "unchanged\n",
               (a_known ? options.b : options.a).c_str());
}

Expected<void, SetupError> compare_spikes(const CompareOptions& options, Comparison& result) {
  const auto a = read_spike_file(options.a);
  if (!a) return Unexpected<SetupError>(a.error());
  const auto b = read_spike_file(options.b);
  if (!b) return Unexpected<SetupError>(b.error());
  note_unknown_start(options, a->from_start, b->from_start);
  result.spikes = match(a->spikes, b->spikes, units::nanoseconds_from_us(options.within_us),
                        [](const RecordedSpike& spike) { return spike.neuron; });
  return {};
}

/// \param optional  two files without commands are no error
Expected<void, SetupError> compare_commands(const CompareOptions& options, bool optional,
                                            Comparison& result) {
  const auto a = read_stimulation_file(options.a);
  if (!a) return Unexpected<SetupError>(a.error());
  const auto b = read_stimulation_file(options.b);
  if (!b) return Unexpected<SetupError>(b.error());
  if (optional && a->commands.empty() && b->commands.empty()) return {};
  if (!optional) note_unknown_start(options, a->from_start, b->from_start);
  result.commands = compare_stimulation(*a, *b,
                                        {.time = units::nanoseconds_from_us(options.within_us),
                                         .amplitude_uA = options.within_uA,
                                         .frequency_Hz = options.within_Hz});
  return {};
}

/// A file of commands is compared with another one or with the commands of a session; two sessions
/// are compared in spikes and commands; all other files in spikes.
Expected<void, SetupError> compare_content(const CompareOptions& options, Comparison& result) {
  const bool commands_a = is_stimulation_csv(options.a);
  const bool commands_b = is_stimulation_csv(options.b);
  const bool session_a = SessionSamples::is_session(options.a);
  const bool session_b = SessionSamples::is_session(options.b);
  if (commands_a || commands_b) {
    if ((commands_a || session_a) && (commands_b || session_b)) {
      return compare_commands(options, false, result);
    }
    return bad_input((commands_a ? options.b : options.a) +
                     " has no stimulation commands: compare " +
                     (commands_a ? options.a : options.b) +
                     " with another file of stim-csv:, or with a session");
  }
  if (auto done = compare_spikes(options, result); !done) return done;
  return session_a && session_b ? compare_commands(options, true, result)
                                : Expected<void, SetupError>();
}

std::string text_of(const CompareOptions& options, const Comparison& result) {
  std::string text;
  if (result.spikes) {
    const TimeDifference apart = time_difference(*result.spikes);
    text += fmt::format("{} spikes in both within {} µs", result.spikes->pairs.size(),
                        options.within_us);
    if (!result.spikes->pairs.empty()) {
      text += fmt::format(", rms {:.3f} µs, largest {:.3f} µs", apart.rms_us, apart.largest_us);
    }
    text += '\n';
    const auto spike = [](const RecordedSpike& each) {
      return fmt::format("neuron {} at {:.9f} s", each.neuron, units::s_from(each.time));
    };
    text += list_of("only in " + options.a, result.spikes->only_a, spike);
    text += list_of("only in " + options.b, result.spikes->only_b, spike);
  }
  if (result.commands) text += text_of(*result.commands, options.a, options.b);
  return text + (result.equal() ? "equal\n" : "different\n");
}

std::string json_of(const CompareOptions& options, const Comparison& result) {
  Json json = {{"equal", result.equal()}, {"within_us", options.within_us}};
  if (result.spikes) {
    const TimeDifference apart = time_difference(*result.spikes);
    json["matched"] = result.spikes->pairs.size();
    json["only_in_a"] = result.spikes->only_a.size();
    json["only_in_b"] = result.spikes->only_b.size();
    json["rms_us"] = apart.rms_us;
    json["largest_us"] = apart.largest_us;
  }
  if (result.commands) json["commands"] = json_of(*result.commands);
  return json_text(json);
}

int compare_files(const CompareOptions& options) {
  Comparison result;
  if (auto done = compare_content(options, result); !done) return refuse(done.error());
  std::fputs((options.json ? json_of(options, result) : text_of(options, result)).c_str(), stdout);
  return result.equal() ? kDone : kFailed;
}

}  // namespace

void add_compare_command(CommandLine& program) {
  auto options = std::make_shared<CompareOptions>();
  program
      .subcommand(
          "compare",
          "Matches the spikes of two files by neuron and time, and lists those without a partner. "
          "Reads CSV, sessions (XDF) and NWB. Stimulation commands, of "
          "stim-csv files and of sessions, are matched by electrode and time; different "
          "amplitudes, frequencies and reasons to stop are listed. Times count from the start of "
          "the run. Exit code 0: equal; 1: different.",
          "compare before.csv after.xdf --within-us 1")
      .option("a", options->a, "File of spikes or commands")
      .required()
      .option("b", options->b, "File of spikes or commands")
      .required()
      .option("--within-us", options->within_us, "Largest difference in time of partners, µs",
              {0.0, 1e9})
      .option("--within-uA", options->within_uA,
              "Largest difference in amplitude of equal commands, µA", {0.0, 1e6})
      .option("--within-Hz", options->within_Hz,
              "Largest difference in frequency of equal commands, Hz", {0.0, 1e6})
      .flag("--json", options->json, "Print the counts as JSON")
      .runs([options] { return compare_files(*options); });
}

}  // namespace merkel
