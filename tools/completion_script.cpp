#include "tools/completion_script.hpp"

#include <algorithm>
#include <array>

#include "tools/shell_text.hpp"

namespace merkel {
namespace {

/// What may follow in one place of the command line. `of` and `words` are never empty.
struct CompletionRow {
  enum class Kind { kCommand, kOption, kArgument };
  Kind kind;
  std::string of;    ///< the command with those above it: "merkel/inspect/session"
  std::string word;  ///< of a command or option
  std::string help;  ///< its first sentence
  CommandTree::Value value = CommandTree::Value::kNone;
  std::vector<std::string> words;  ///< that the value may have
};
using Kind = CompletionRow::Kind;
using Value = CommandTree::Value;

/// The first sentence of a help text.
std::string first_sentence(const std::string& help) {
  const std::size_t end = std::min(help.find(". "), help.find('\n'));
  std::string sentence = help.substr(0, end);
  if (sentence.ends_with('.')) sentence.pop_back();
  return sentence;
}

void add_completion_rows(const CommandTree& command, const CompletionWords& words,
                         const std::string& path, std::vector<CompletionRow>& rows) {
  for (const CommandTree::Option& option : command.options) {
    const auto known = words.find(option.name);
    rows.push_back({.kind = option.name.starts_with('-') ? Kind::kOption : Kind::kArgument,
                    .of = path,
                    .word = option.name,
                    .help = first_sentence(option.help),
                    .value = option.value,
                    .words = known == words.end() ? std::vector<std::string>{} : known->second});
  }
  for (const CommandTree& below : command.commands) {
    rows.push_back({.kind = Kind::kCommand,
                    .of = path,
                    .word = below.name,
                    .help = first_sentence(below.what),
                    .words = {}});
    add_completion_rows(below, words, path + "/" + below.name, rows);
  }
}

std::string joined_by_spaces(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

/// What follows an option or is an argument: words, or "=file" or "=value".
std::string value_of(const CompletionRow& row) {
  if (!row.words.empty()) {
    return joined_by_spaces(row.words) + (row.value == Value::kText ? " =file" : "");
  }
  return row.value == Value::kText ? "=file" : "=value";
}

/// The rows as associative arrays: of commands, options and values.
std::string shell_tables(const std::vector<CompletionRow>& rows, const char* declare) {
  std::string text =
      std::string(declare) + " _merkel_commands=() _merkel_options=() _merkel_values=()\n";
  const auto add = [&text](const char* table, const std::string& key, const std::string& line) {
    text += std::string(table) + "[" + key + "]+=" + shell_quoted(line) + "$'\\n'\n";
  };
  for (const CompletionRow& row : rows) {
    const std::string described = row.word + ":" + row.help;
    if (row.kind == Kind::kCommand) add("_merkel_commands", row.of, described);
    if (row.kind == Kind::kOption) add("_merkel_options", row.of, described);
    if (row.kind == Kind::kArgument) add("_merkel_values", row.of, value_of(row));
    if (row.kind == Kind::kOption && row.value != Value::kNone) {
      add("_merkel_values", row.of + "/" + row.word, value_of(row));
    }
  }
  return text;
}

constexpr const char* kBashBody = R"sh(
_merkel() {
  local word=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD - 1]} at=merkel each values
  for each in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    [[ $'\n'${_merkel_commands[$at]} == *$'\n'"$each":* ]] && at+="/$each"
  done
  COMPREPLY=()
  if [[ $previous == -* && -n ${_merkel_values[$at/$previous]} ]]; then
    values=${_merkel_values[$at/$previous]}
  elif [[ $word == -* ]]; then
    values=$(sed 's/:.*//' <<<"${_merkel_options[$at]}")
  elif [[ -n ${_merkel_commands[$at]} ]]; then
    values=$(sed 's/:.*//' <<<"${_merkel_commands[$at]}")
  else
    values=${_merkel_values[$at]}
  fi
  COMPREPLY=($(compgen -W "${values//=@(file|value)/}" -- "$word"))
  [[ $values != *=file* ]] || { compopt -o filenames; COMPREPLY+=($(compgen -f -- "$word")); }
}
complete -F _merkel merkel
)sh";

std::string bash_script(const std::vector<CompletionRow>& rows) {
  return "# bash completion of merkel: merkel completion bash\nshopt -q extglob || shopt -s extglob\n" +
         shell_tables(rows, "declare -gA") + kBashBody;
}

constexpr const char* kZshBody = R"sh(
_merkel() {
  local at=merkel each values previous=$words[CURRENT-1]
  local -a choices
  for each in ${words[2,CURRENT-1]}; do
    [[ $'\n'$_merkel_commands[$at] == *$'\n'"$each":* ]] && at+="/$each"
  done
  if [[ $previous == -* && -n $_merkel_values[$at/$previous] ]]; then
    values=$_merkel_values[$at/$previous]
  elif [[ $words[CURRENT] == -* ]]; then
    choices=(${(f)_merkel_options[$at]})
  elif [[ -n $_merkel_commands[$at] ]]; then
    choices=(${(f)_merkel_commands[$at]})
  else
    values=$_merkel_values[$at]
  fi
  (( ! $#choices )) || _describe merkel choices
  choices=(${${=values}:#=*})
  (( ! $#choices )) || compadd -a choices
  [[ $values != *=file* ]] || _files
}
compdef _merkel merkel
# In a folder of $fpath, this file is the function's first call.
[[ $funcstack[1] != _merkel ]] || _merkel
)sh";

std::string zsh_script(const std::vector<CompletionRow>& rows) {
  return "#compdef merkel\n# zsh completion of merkel: merkel completion zsh\n" +
         shell_tables(rows, "typeset -gA") + kZshBody;
}

constexpr const char* kFishHead = R"sh(# fish completion of merkel: merkel completion fish
function __merkel_at
  set -l at merkel
  for word in (commandline -opc)[2..-1]
    contains -- "$at/$word" $__merkel_paths; and set at "$at/$word"
  end
  test "$at" = "$argv[1]"
end
complete -c merkel -f
)sh";

std::string fish_quoted(const std::string& text) { return shell_quoted(text, R"(\')"); }

std::string fish_script(const std::vector<CompletionRow>& rows) {
  std::string paths = "set -g __merkel_paths";
  std::string text = kFishHead;
  for (const CompletionRow& row : rows) {
    const std::string help = row.help.empty() ? "" : " -d " + fish_quoted(row.help);
    text += "complete -c merkel -n " + fish_quoted("__merkel_at \"" + row.of + "\"");
    if (row.kind == Kind::kCommand) {
      paths += " " + row.of + "/" + row.word;
      text += " -a " + row.word + help;
    } else {
      if (row.kind == Kind::kOption) text += " -l " + row.word.substr(2) + help;
      if (row.value == Value::kText) text += row.kind == Kind::kOption ? " -r -F" : " -F";
      if (row.value == Value::kNumber) text += " -x";
      if (!row.words.empty()) text += " -a " + fish_quoted(joined_by_spaces(row.words));
    }
    text += "\n";
  }
  return text + paths + "\n";
}

struct CompletionShell {
  const char* name;
  std::string (*script)(const std::vector<CompletionRow>&);
};
constexpr std::array kCompletionShells{CompletionShell{"bash", bash_script},
                                       CompletionShell{"fish", fish_script},
                                       CompletionShell{"zsh", zsh_script}};

}  // namespace

std::vector<std::string> completion_shells() {
  std::vector<std::string> names;
  for (const CompletionShell& shell : kCompletionShells) names.emplace_back(shell.name);
  return names;
}

Expected<std::string, SetupError> completion_script(const CommandTree& program,
                                                    const CompletionWords& words,
                                                    std::string_view shell) {
  std::vector<CompletionRow> rows;
  add_completion_rows(program, words, program.name, rows);
  for (const CompletionShell& each : kCompletionShells) {
    if (each.name == shell) return each.script(rows);
  }
  return bad_input("there is no completion for the shell \"" + std::string(shell) +
                   "\": choose bash, fish or zsh");
}

}  // namespace merkel
