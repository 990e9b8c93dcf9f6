#include <algorithm>
#include <fstream>
#include <optional>
#include <sstream>

#include "core/parameters/nearest_name.hpp"
#include "core/simd/simd_target.hpp"
#include "drivers/files/embedded_text.hpp"
#include "drivers/take_part.hpp"
#include "tools/scene/prepared_run.hpp"
#include "tools/scene/scene_presets.hpp"
#include "tools/self_test/self_test.hpp"

namespace merkel {

extern const std::span<const EmbeddedText> kGoldenSpikes;  ///< tests/golden/PRESET.taps.csv
namespace {

/// The press of tests/traces/taps.csv.
constexpr const char* kGoldenPress = "sim:taps?depth_mm=1.5";

/// The next line of a text that is no comment; none at its end.
std::optional<std::string_view> next_spike_row(std::string_view& text) {
  while (!text.empty()) {
    const std::string_view row = take_part(text, '\n');
    if (!row.starts_with('#')) return row;
  }
  return std::nullopt;
}

/// The spikes of a preset as a spike file. Only its first probe presses.
Expected<std::string, SetupError> golden_run(const std::string& preset, const std::string& file) {
  auto scene = preset_scene(preset);
  if (!scene) return bad_input("there is no preset " + preset);
  scene->probes.resize(1);
  scene->probes.front().uri = kGoldenPress;
  scene->model.indenters.resize(1);
  auto run = prepare_run(std::move(*scene), {.fast = true});
  if (!run) return Unexpected<SetupError>(run.error());
  const std::string error = failure_of(run->run({"csv:" + file}, {.overwrite = true}));
  if (!error.empty()) return unavailable(error);
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

std::string preset_of(std::string_view golden_file) {
  return std::string(golden_file.substr(0, golden_file.find('.')));
}

/// Compares every preset. Empty, or the first difference.
std::string golden_difference(const std::string& folder) {
  for (const EmbeddedText& golden : kGoldenSpikes) {
    const std::string preset = preset_of(golden.name);
    const auto spikes = golden_run(preset, folder + "/spikes.csv");
    if (!spikes) return preset + ": " + spikes.error().sentence;
    const std::string difference = spike_rows_differ(golden.text, *spikes);
    if (!difference.empty()) return preset + ": " + difference;
  }
  return {};
}

}  // namespace

std::string spike_rows_differ(std::string_view wanted, std::string_view found) {
  for (int row = 0;; ++row) {
    const auto a = next_spike_row(wanted);
    const auto b = next_spike_row(found);
    if (!a && !b) return {};
    if (a == b) continue;
    return "row " + std::to_string(row) + " is " + std::string(b.value_or("missing")) + ", not " +
           std::string(a.value_or("missing"));
  }
}

SelfCheck check_golden_spikes(const std::string& target, const std::string& folder) {
  SelfCheck check{.what = "golden spikes with " + target};
  if (auto forced = force_simd_target(target); !forced) {
    check.finding = forced.error().sentence;
    return check;
  }
  check.finding = golden_difference(folder);
  static_cast<void>(force_simd_target(""));
  check.passed = check.finding.empty();
  if (!check.passed) return check;
  check.finding = listed(kGoldenSpikes, [](const auto& each) { return preset_of(each.name); });
  return check;
}

}  // namespace merkel
