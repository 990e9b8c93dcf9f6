// Arbitrary bytes as a scene (TOML). Built and run by fuzz.sh with libFuzzer.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "tools/scene/scene_file.hpp"
#include "tools/scene/scene_keys.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace merkel;
  const auto scene = parse_scene({reinterpret_cast<const char*>(data), size}, "s.toml");
  if (!scene) return scene.error().sentence.empty() ? std::abort(), 0 : 0;
  // A session records the scene's text; it must reproduce the scene.
  const auto again = parse_scene(scene->text, "s.toml");
  if (!again || again->sinks != scene->sinks || again->probes.size() != scene->probes.size()) {
    std::abort();
  }
  // The printed scene parses to the same value of every key.
  const std::string printed = scene_text(*scene);
  const auto read = parse_scene(printed, "s.toml");
  if (!read || scene_text(*read) != printed) std::abort();
  return 0;
}
