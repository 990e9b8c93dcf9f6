#include "tools/batch/batch_identity.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <string_view>
#include <system_error>
#include <vector>

#include "core/records/spike_hash.hpp"
#include "core/units.hpp"
#include "drivers/files/example_file.hpp"
#include "drivers/files/input_file.hpp"
#include "drivers/files/toml.hpp"
#include "drivers/probes/channel_selection.hpp"
#include "drivers/sessions/rig_recording.hpp"
#include "drivers/uri.hpp"
#include "tools/scene/machine_facts.hpp"
#include "tools/scene/scene_keys.hpp"

namespace merkel {
namespace {

/// A word of a command, in quotes where a POSIX shell needs them.
std::string shell_word(std::string_view text) {
  const auto plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::string_view("_-./:=,+").find(c) != std::string_view::npos;
  };
  const bool bare = !text.empty() && std::all_of(text.begin(), text.end(), plain);
  if (bare) return std::string(text);
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string(R"('\'')") : std::string(1, c);
  return quoted + "'";
}

/// A hash of a file's content, which is read once while it does not change; empty without a file.
std::string hash_of_file(const std::string& path) {
  struct Known {
    std::filesystem::file_time_type time;
    std::uintmax_t size = 0;
    std::string hash;
  };
  static std::map<std::string, Known> known;
  std::error_code ignored;
  // The run of a file that cannot be read says so.
  if (!std::filesystem::is_regular_file(path, ignored)) return {};
  ReadFiles::note(path);
  const auto time = std::filesystem::last_write_time(path, ignored);
  const std::uintmax_t size = std::filesystem::file_size(path, ignored);
  Known& of_file = known[path];
  if (of_file.hash.empty() || of_file.time != time || of_file.size != size) {
    SpikeHash hash;
    std::ifstream file(path, std::ios::binary);
    std::string piece(std::size_t{1} << 20U, '\0');
    while (file.good()) {
      file.read(piece.data(), static_cast<std::streamsize>(piece.size()));
      hash.add(piece.substr(0, static_cast<std::size_t>(file.gcount())));
    }
    of_file = {time, size, hash.text()};
  }
  return of_file.hash;
}

/// A text of a job or a scene; in place of the name of a file, a hash of its content.
std::string content_of(const std::string& text) {
  const auto content = [](const std::string& name, const std::string& path) {
    const auto [file, rig] = split_rig(path);
    const std::string hash = hash_of_file(file);
    return hash.empty() ? name : "#" + hash + "@" + rig;
  };
  const auto [whole, fragment] = split_fragment(text);
  const auto uri = Uri::parse(whole);
  if (!uri) return content(text, text);
  const std::string path =
      uri->scheme == "replay" ? path_or_example(Example::kTrace, uri->path) : uri->path;
  std::string all = uri->scheme + ":" + content(uri->path, path);
  for (const auto& [name, value] : uri->options) all += "?" + name + "=" + content(value, value);
  if (fragment) all += "#" + *fragment;
  return all;
}

/// The texts in a scene's tables that may name a file that it reads, in order.
std::vector<std::string> texts_in(const std::string& scene) {
  std::vector<std::string> texts;
  const auto parsed = parse_toml(scene);
  if (!parsed) return texts;  // the name of a preset
  const std::function<void(const toml::node&)> collect = [&](const toml::node& node) {
    if (const auto text = node.value_exact<std::string>()) texts.push_back(*text);
    if (const auto* table = node.as_table()) {
      for (const auto& [key, value] : *table) collect(value);
    }
    if (const auto* array = node.as_array()) {
      for (const toml::node& value : *array) collect(value);
    }
  };
  collect(*parsed);
  return texts;
}

/// The text of a scene with the contents of its files: shapes, recordings, calibrations.
std::string content_of_scene(const std::string& scene) {
  static std::map<std::string, std::vector<std::string>> known;
  const auto [at, added] = known.try_emplace(scene);
  if (added) at->second = texts_in(scene);
  std::string content = scene;
  for (const std::string& text : at->second) content += content_of(text);
  return content;
}

}  // namespace

std::string scene_identity(const Scene& scene) {
  std::string identity = scene_text(scene);
  for (const std::string& heights : heights_of(scene)) {
    SpikeHash hash;
    hash.add(heights);
    identity += "\n# heights " + hash.text();
  }
  return identity;
}

std::string batch_id(const BatchJob& job, const std::string& scene, const std::string& kept,
                     const std::string& more) {
  SpikeHash hash;
  const auto all = {std::string(MERKEL_VERSION),
                    std::string(kGitHash),
                    content_of_scene(scene),
                    content_of(job.probe),
                    job.seed ? std::to_string(*job.seed) : std::string(),
                    job.duration_s ? shortest_decimal(*job.duration_s) : std::string(),
                    kept,
                    kept.empty() ? std::string() : job.name,
                    more};
  for (const std::string& each : all) hash.add(each);
  for (const auto& [name, value] : job.overrides) {
    hash.add(name);
    hash.add(content_of(value));
  }
  return hash.text();
}

Expected<std::string, SetupError> kept_file(const BatchJob& job, const std::string& extension) {
  constexpr std::size_t kMaxBytes = 200;
  const std::string& name = job.name;
  const bool fits = name.size() <= kMaxBytes && !name.starts_with('.') &&
                    name.find_first_of("/?#&%|\\\"") == std::string::npos &&
                    std::none_of(name.begin(), name.end(),
                                 [](char c) { return static_cast<unsigned char>(c) < 0x20; });
  const std::string file = (name.empty() ? job.id : name) + "." + extension;
  if (fits && file != BatchKeep::kTable) return file;
  return bad_input("the name \"" + name +
                   "\" of a job cannot be that of its kept file: use at most 200 letters, digits, "
                   "blanks, - and _, no dot at its start, and not results");
}

std::string command_of(const BatchJob& job) {
  std::string text = "merkel run " + shell_word(job.scene) + " --fast";
  const auto add = [&text](const std::string& option, const std::string& value) {
    text += " " + option + " " + shell_word(value);
  };
  if (!job.probe.empty()) add("--probe", job.probe);
  if (job.seed) add("--seed", std::to_string(*job.seed));
  if (job.duration_s) add("--duration-s", shortest_decimal(*job.duration_s));
  for (const auto& [name, value] : job.overrides) add("--set", name + "=" + value);
  return text;
}

}  // namespace merkel
