#include <cstdio>
#include <memory>
#include <string>

#include "core/simd/simd_target.hpp"
#include "drivers/protocols/protocol_table.hpp"
#include "tools/commands/command.hpp"
#include "tools/completion_script.hpp"
#include "tools/scene/scene_presets.hpp"

namespace merkel {
namespace {

CompletionWords known_words() {
  CompletionWords words{
      {"scene", preset_names()}, {"shell", completion_shells()}, {"--target", simd_targets()}};
  for (const ProtocolEntry& entry : protocol_table()) {
    words["protocol"].emplace_back(entry.name);
  }
  return words;
}

}  // namespace

void add_completion_command(CommandLine& program) {
  auto shell = std::make_shared<std::string>();
  program
      .subcommand("completion",
                  "Prints the script with which a shell completes commands and options. The Debian "
                  "package installs the scripts.",
                  "completion bash > ~/.local/share/bash-completion/completions/merkel")
      .option("shell", *shell, "bash, fish or zsh")
      .required()
      .notes(
          "fish: ~/.config/fish/completions/merkel.fish\n"
          "zsh: a file _merkel in a folder of $fpath")
      .runs([shell, program] {
        const auto script = completion_script(program.tree(), known_words(), *shell);
        if (!script) return refuse(script.error());
        std::fputs(script->c_str(), stdout);
        return kDone;
      });
}

}  // namespace merkel
