#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tools/scene/scene_file.hpp"

namespace merkel {

struct RunOptions {
  std::string scene = {};
  std::vector<std::string> probes = {};
  std::vector<std::string> sinks = {};
  std::vector<std::string> set = {};  ///< KEY=VALUE, in order
  bool fast = false;
  bool json = false;
  bool all = false;
  bool overwrite = false;
  bool allow_remote = false;
  bool strict = false;
  bool repeat = false;
  std::string record = {};
  std::optional<double> duration_s = {};
  std::optional<std::uint64_t> seed = {};
};

/// Runs a scene and prints a summary. Of the options, those that change the scene are ignored:
/// scene, set, probes, sinks, repeat, seed. \return the exit code
int run_scene(Scene scene, const RunOptions& options);

}  // namespace merkel
