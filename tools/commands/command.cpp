#include "tools/commands/command.hpp"

#include <cstdio>

#include "drivers/printable_text.hpp"
#include "tools/scene/scene_presets.hpp"

namespace merkel {
namespace {

/// Sentences quote files and devices, which may hold a terminal's control sequences.
int complain(const std::string& sentence, int exit_code) {
  std::fflush(stdout);
  std::fprintf(stderr, "merkel: %s\n", printable_lines(sentence).c_str());
  return exit_code;
}

}  // namespace

Expected<Scene, SetupError> given_scene(const std::string& name_or_file) {
  auto scene = scene_named(name_or_file);
  if (scene && !scene->notice.empty()) {
    std::fprintf(stderr, "merkel: %s\n", scene->notice.c_str());
  }
  return scene;
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text.append(text.empty() ? "" : ", ").append(word);
  return text;
}

int refuse(const std::string& sentence) { return complain(sentence, kWrongInput); }

int refuse(const SetupError& error) {
  return complain(error.sentence,
                  error.kind == SetupError::Kind::kUnavailable ? kRefused : kWrongInput);
}

int fail(const std::string& sentence) { return complain(sentence, kFailed); }

}  // namespace merkel
