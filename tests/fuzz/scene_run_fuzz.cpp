// Scenes of presets with unusual values, run for up to 100 ticks: each runs or is refused. The
// bytes select preset, keys and values; method and step change as a session may change them. Built
// and run by fuzz.sh with libFuzzer, which limits time and memory.
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <string>
#include <variant>

#include <fuzzer/FuzzedDataProvider.h>

#include "tests/fuzz/scene_run.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace merkel;
  FuzzedDataProvider bytes(data, size);
  const char* const preset =
      bytes.PickValueInArray({"paper", "paper", "paper", "paper-wide", "paper-wide", "goodwin",
                              "goodwin", "goodwin", "hand"});
  std::string text = std::string("preset = \"") + preset + "\"\n";
  for (int changes = bytes.ConsumeIntegralInRange(1, 4); changes > 0; --changes) {
    static const std::vector<std::string> keys = number_keys();
    const std::string& key = keys[bytes.ConsumeIntegralInRange<std::size_t>(0, keys.size() - 1)];
    std::string value =
        kUnusualValues[bytes.ConsumeIntegralInRange<std::size_t>(0, std::size(kUnusualValues) - 1)];
    if (bytes.ConsumeBool()) {
      char number[40];
      std::snprintf(number, sizeof number, "%.17g", bytes.ConsumeFloatingPoint<double>());
      value = number;
    }
    // Dotted keys, so that one table can be changed twice.
    text += key + " = " + value + "\n";
  }
  auto scene = parse_scene(text, "s.toml");
  if (!scene) return scene.error().sentence.empty() ? std::abort(), 0 : 0;
  if (auto* const paper = std::get_if<HodgkinHuxleyAfferent>(&scene->model.afferent);
      paper != nullptr && bytes.ConsumeBool()) {
    paper->method = bytes.PickValueInArray(
        {IntegrationMethod::kForwardEuler, IntegrationMethod::kExponentialEuler,
         IntegrationMethod::kBackwardEuler, IntegrationMethod::kRushLarsen,
         IntegrationMethod::kCrankNicolson, IntegrationMethod::kHeun, IntegrationMethod::kRk4});
    paper->precision = bytes.ConsumeBool() ? Precision::kFloat : Precision::kDouble;
  }
  if (bytes.ConsumeBool()) {
    scene->model.step = std::chrono::nanoseconds{bytes.ConsumeIntegral<std::int64_t>()};
  }
  const std::string fault = fault_of_run(*scene, 100, 3e6);
  if (!fault.empty()) {
    std::fprintf(stderr, "%s: %s\n", text.c_str(), fault.c_str());
    std::abort();
  }
  return 0;
}
