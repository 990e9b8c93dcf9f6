#include <algorithm>
#include <cstdio>
#include <map>
#include <memory>
#include <span>
#include <sstream>
#include <string>

#include "core/simd/simd_target.hpp"
#include "drivers/protocols/protocol_table.hpp"
#include "tools/commands/command.hpp"
#include "tools/scene/scene_presets.hpp"

namespace merkel {
namespace {

/// Each asks the program for the words that may be next: "merkel __complete merkel run pa" prints a
/// line "WORD<tab>help" for each, after a line "=file" where a file may be next.
const std::map<std::string, const char*> kCompletionScripts{
    {"bash", R"sh(# bash completion of merkel: merkel completion bash
_merkel() {
  local IFS=$'\n' found
  found=$(command "${COMP_WORDS[0]}" __complete "${COMP_WORDS[@]:0:COMP_CWORD+1}")
  COMPREPLY=($(cut -f 1 <<<"${found#=file}"))
  [[ $found != =file* ]] || { compopt -o filenames; COMPREPLY+=($(compgen -f -- "${COMP_WORDS[COMP_CWORD]}")); }
}
complete -F _merkel merkel
)sh"},
    {"fish", R"sh(# fish completion of merkel: merkel completion fish
function __merkel_complete
  set -l word (commandline -ct)
  for found in (command merkel __complete (commandline -opc) "$word")
    test "$found" = =file; and __fish_complete_path "$word"; or echo $found
  end
end
complete -c merkel -f -a '(__merkel_complete)'
)sh"},
    {"zsh", R"sh(#compdef merkel
# zsh completion of merkel: merkel completion zsh
_merkel() {
  local -a choices=(${${(f)"$(command $words[1] __complete "${(@)words[1,CURRENT]}")"}/$'\t'/:})
  [[ $choices[1] != '=file' ]] || { shift choices; _files }
  (( ! $#choices )) || _describe merkel choices
}
compdef _merkel merkel
# In a folder of $fpath, this file is the function's first call.
[[ $funcstack[1] != _merkel ]] || _merkel
)sh"}};

/// The known values of options and arguments, by the name of the option or argument. A tab
/// separates a value from its help, if it has some.
std::map<std::string, std::vector<std::string>> known_words() {
  std::map<std::string, std::vector<std::string>> words{
      {"scene", {}}, {"shell", {}}, {"--target", simd_targets()}};
  std::istringstream scenes(preset_list("", "\t") + example_scene_list("", "\t"));
  for (std::string line; std::getline(scenes, line);) words["scene"].push_back(line);
  for (const auto& [shell, script] : kCompletionScripts) words["shell"].push_back(shell);
  for (const ProtocolEntry& entry : protocol_table()) {
    words["protocol"].emplace_back(entry.name);
  }
  return words;
}

/// Prints what the last word of a command line may become.
int complete(const CommandTree& program, std::span<char* const> line) {
  if (line.empty()) return kDone;
  const std::string_view last = line.back();
  const std::string_view previous = line.size() > 1 ? line[line.size() - 2] : "";
  const CommandTree* command = &program;
  for (const std::string_view word :
       line.first(line.size() - 1).subspan(std::min<std::size_t>(1, line.size() - 1))) {
    const auto& below = command->commands;
    const auto next = std::find_if(below.begin(), below.end(),
                                   [&](const auto& each) { return each.name == word; });
    if (next != below.end()) command = &*next;
  }
  std::string found;
  bool file = false;
  const auto offer = [&](const std::string& word, const std::string& help) {
    if (word.starts_with(last))
      found += word + "\t" + help.substr(0, std::min(help.find(". "), help.find('\n'))) + "\n";
  };
  const auto offer_values = [&, words = known_words()](const CommandTree::Option& option) {
    const auto known = words.find(option.name);
    if (known != words.end()) {
      for (const std::string& word : known->second) {
        const std::size_t end = word.find('\t');
        offer(word.substr(0, end), end == std::string::npos ? "" : word.substr(end + 1));
      }
    }
    file = file || option.value == CommandTree::Value::kText;
  };
  const auto& options = command->options;
  const auto valued = std::find_if(options.begin(), options.end(), [&](const auto& each) {
    return each.name.starts_with('-') && each.name == previous &&
           each.value != CommandTree::Value::kNone;
  });
  if (valued != options.end()) {
    offer_values(*valued);
  } else if (last.starts_with('-') || command->commands.empty()) {
    for (const CommandTree::Option& option : options) {
      const bool argument = !option.name.starts_with('-');
      if (argument && !last.starts_with('-')) offer_values(option);
      if (!argument && last.starts_with('-')) offer(option.name, option.help);
    }
  } else {
    for (const CommandTree& below : command->commands) offer(below.name, below.what);
  }
  std::fputs(((file ? "=file\n" : "") + found).c_str(), stdout);
  return kDone;
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
      .runs([shell] {
        const auto script = kCompletionScripts.find(*shell);
        if (script == kCompletionScripts.end()) {
          return refuse("there is no completion for the shell \"" + *shell +
                        "\": choose bash, fish or zsh");
        }
        std::fputs(script->second, stdout);
        return kDone;
      });
  program.completes(complete);
}

}  // namespace merkel
