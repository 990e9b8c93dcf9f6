#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/units.hpp"
#include "drivers/spike_files/spike_file.hpp"
#include "tools/commands/command.hpp"
#include "tools/json_text.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

constexpr std::size_t kShown = 10;

struct CompareOptions {
  std::string a;
  std::string b;
  double within_us = 1.0;
  bool json = false;
};

/// How the spikes of two files go together.
struct Comparison {
  std::size_t matched = 0;
  std::vector<RecordedSpike> only_a;  ///< without a partner in B
  std::vector<RecordedSpike> only_b;
  double rms_us = 0.0;  ///< of the times of partners
  double largest_us = 0.0;

  [[nodiscard]] bool equal() const noexcept { return only_a.empty() && only_b.empty(); }
};

using Trains = std::map<std::uint32_t, std::vector<nanoseconds>>;

Trains trains_of(const SpikeFile& file) {
  Trains trains;
  for (const RecordedSpike& spike : file.spikes) trains[spike.neuron].push_back(spike.time);
  return trains;
}

/// Partners are spikes of one neuron, in order of time, that lie no further apart than `within`.
Comparison compare(const SpikeFile& a, const SpikeFile& b, nanoseconds within) {
  Trains of_a = trains_of(a);
  Trains of_b = trains_of(b);
  for (const auto& [neuron, train] : of_b) of_a[neuron];
  Comparison result;
  double sum = 0.0;
  for (const auto& [neuron, in_a] : of_a) {
    const std::vector<nanoseconds>& in_b = of_b[neuron];
    std::size_t i = 0;
    std::size_t j = 0;
    while (i < in_a.size() || j < in_b.size()) {
      if (j == in_b.size() || (i < in_a.size() && in_a[i] < in_b[j] - within)) {
        result.only_a.push_back({in_a[i++], neuron});
      } else if (i == in_a.size() || in_b[j] < in_a[i] - within) {
        result.only_b.push_back({in_b[j++], neuron});
      } else {
        const double apart_us = units::us_from(in_a[i++] - in_b[j++]);
        sum += apart_us * apart_us;
        result.largest_us = std::max(result.largest_us, std::fabs(apart_us));
        ++result.matched;
      }
    }
  }
  if (result.matched > 0) result.rms_us = std::sqrt(sum / static_cast<double>(result.matched));
  std::sort(result.only_a.begin(), result.only_a.end());
  std::sort(result.only_b.begin(), result.only_b.end());
  return result;
}

std::string list_of(const std::string& file, const std::vector<RecordedSpike>& spikes) {
  if (spikes.empty()) return {};
  std::string text = fmt::format("only in {}: {}\n", file, spikes.size());
  for (std::size_t i = 0; i < std::min(kShown, spikes.size()); ++i) {
    text +=
        fmt::format("  neuron {} at {:.9f} s\n", spikes[i].neuron, units::s_from(spikes[i].time));
  }
  if (spikes.size() > kShown) text += fmt::format("  and {} more\n", spikes.size() - kShown);
  return text;
}

std::string text_of(const CompareOptions& options, const Comparison& result) {
  std::string text =
      fmt::format("{} spikes of both within {} us, rms {:.3f} us, largest {:.3f} us\n",
                  result.matched, options.within_us, result.rms_us, result.largest_us);
  text += list_of(options.a, result.only_a) + list_of(options.b, result.only_b);
  return text + (result.equal() ? "equal\n" : "different\n");
}

std::string json_of(const CompareOptions& options, const Comparison& result) {
  const nlohmann::ordered_json json = {
      {"equal", result.equal()},           {"within_us", options.within_us},
      {"matched", result.matched},         {"only_in_a", result.only_a.size()},
      {"only_in_b", result.only_b.size()}, {"rms_us", result.rms_us},
      {"largest_us", result.largest_us}};
  return json_text(json);
}

int compare_files(const CompareOptions& options) {
  auto a = read_spike_file(options.a);
  if (!a) return refuse(a.error());
  auto b = read_spike_file(options.b);
  if (!b) return refuse(b.error());
  if (a->from_start != b->from_start) {
    std::fprintf(
        stderr,
        "merkel: note: %s does not say when its run started: its times are compared as they "
        "stand\n",
        (a->from_start ? options.b : options.a).c_str());
  }
  const nanoseconds within = units::nanoseconds_from_us(options.within_us);
  const Comparison result = compare(*a, *b, within);
  std::fputs((options.json ? json_of(options, result) : text_of(options, result)).c_str(), stdout);
  return result.equal() ? kDone : kFailed;
}

}  // namespace

void add_compare_command(CommandLine& program) {
  auto options = std::make_shared<CompareOptions>();
  program
      .subcommand("compare",
                  "Matches the spikes of two files, neuron by neuron, and lists those without a "
                  "partner: exit code 0 if there is none, 1 if there is. Reads CSV, GDF, sessions "
                  "(XDF), SONATA, NWB and folders of Phy. Times count from the start of the run.",
                  "compare before.csv after.xdf --within-us 1")
      .option("a", options->a, "File of spikes")
      .required()
      .option("b", options->b, "File of spikes")
      .required()
      .option("--within-us", options->within_us, "How far apart partners may be, µs", {0.0, 1e9})
      .flag("--json", options->json, "Print the counts as JSON")
      .runs([options] { return compare_files(*options); });
}

}  // namespace merkel
