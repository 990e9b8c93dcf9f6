#include "tools/commands/compare_stimulation.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include <fmt/format.h>

#include "core/units.hpp"
#include "tools/commands/compare_list.hpp"
#include "tools/json_text.hpp"
#include "tools/scene/session_scene.hpp"

namespace merkel {
namespace {

std::string place_of(const RecordedCommand& command) {
  return fmt::format("{} at {:.9f} s", command.electrode, units::s_from(command.time));
}

std::string value_of(const RecordedCommand& command) {
  std::string text = fmt::format("{} µA, {} Hz", command.amplitude_uA, command.frequency_Hz);
  if (command.stop != StimulationCommand::Stop::kNone) {
    text += fmt::format(" (stop: {})", name_of(command.stop));
  }
  if (command.sent.count() != 0) text += fmt::format(", sent at {} ns", command.sent.count());
  return text;
}

/// Whether its commands have the times at which they left.
bool has_sent_times(const std::vector<RecordedCommand>& commands) {
  return !commands.empty() && commands.back().sent.count() != 0;
}

/// Of a session, what left, if the other file holds that too.
const std::vector<RecordedCommand>& compared_of(const StimulationFile& file,
                                                const StimulationFile& other) {
  return has_sent_times(other.commands) && !file.sent.empty() ? file.sent : file.commands;
}

/// Infinite if only one value is a number.
double distance(double a, double b) {
  if (a == b || (std::isnan(a) && std::isnan(b))) return 0.0;
  const double apart = std::fabs(a - b);
  return std::isnan(apart) ? HUGE_VAL : apart;
}

}  // namespace

Expected<StimulationFile, SetupError> read_stimulation_file(const std::string& path) {
  if (is_stimulation_csv(path)) return read_stimulation_csv(path);
  auto session = SessionReader::open(path);
  if (!session) return Unexpected<SetupError>(session.error());
  std::vector<std::string> electrodes;
  if (!session->fact("scene_text").empty()) {
    const auto scene = scene_of_session(*session);
    if (!scene) return Unexpected<SetupError>(scene.error());
    for (const Electrode& electrode : scene->encoding.electrodes) {
      electrodes.push_back(electrode.name);
    }
  }
  if (electrodes.empty()) return StimulationFile{.commands = {}, .from_start = true};
  return read_session_commands(*session, electrodes);
}

StimulationComparison compare_stimulation(const StimulationFile& a, const StimulationFile& b,
                                          const StimulationTolerance& tolerance) {
  StimulationComparison result;
  result.matching = match(compared_of(a, b), compared_of(b, a), tolerance.time,
                          [](const RecordedCommand& command) {
                            return std::make_pair(command.electrode, command.kind);
                          });
  for (const auto& [in_a, in_b] : result.matching.pairs) {
    const double apart_uA = distance(in_a.amplitude_uA, in_b.amplitude_uA);
    const double apart_Hz = distance(in_a.frequency_Hz, in_b.frequency_Hz);
    const bool has_both_times = in_a.sent.count() != 0 && in_b.sent.count() != 0;
    result.largest_uA = std::max(result.largest_uA, apart_uA);
    result.largest_Hz = std::max(result.largest_Hz, apart_Hz);
    if (apart_uA > tolerance.amplitude_uA || apart_Hz > tolerance.frequency_Hz ||
        in_a.stop != in_b.stop || (in_a.sent != in_b.sent && has_both_times)) {
      result.different.emplace_back(in_a, in_b);
    }
  }
  std::stable_sort(result.different.begin(), result.different.end(),
                   [](const auto& x, const auto& y) { return x.first.time < y.first.time; });
  return result;
}

std::string text_of(const StimulationComparison& result, const std::string& name_a,
                    const std::string& name_b) {
  const TimeDifference apart = time_difference(result.matching);
  std::string text = fmt::format(
      "{} stimulation commands in both, rms {:.3f} µs, largest {:.3f} µs; amplitudes differ by at "
      "most {} µA, frequencies by {} Hz\n",
      result.matching.pairs.size(), apart.rms_us, apart.largest_us, result.largest_uA,
      result.largest_Hz);
  text += list_of("different", result.different, [](const auto& pair) {
    return place_of(pair.first) + ": " + value_of(pair.first) + " against " + value_of(pair.second);
  });
  const auto command = [](const RecordedCommand& each) {
    return place_of(each) + ": " + std::string(name_of(each.kind)) + ", " + value_of(each);
  };
  text += list_of("only in " + name_a, result.matching.only_a, command);
  return text + list_of("only in " + name_b, result.matching.only_b, command);
}

Json json_of(const StimulationComparison& result) {
  const TimeDifference apart = time_difference(result.matching);
  return {{"matched", result.matching.pairs.size()},
          {"only_in_a", result.matching.only_a.size()},
          {"only_in_b", result.matching.only_b.size()},
          {"different", result.different.size()},
          {"rms_us", apart.rms_us},
          {"largest_us", apart.largest_us},
          {"largest_amplitude_uA", result.largest_uA},
          {"largest_frequency_Hz", result.largest_Hz}};
}

}  // namespace merkel
