#include "tools/command_line.hpp"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "core/parameters/nearest_name.hpp"
#include "tools/commands/command.hpp"
#include "tools/scene/machine_facts.hpp"

namespace merkel {
namespace {

constexpr const char* kExitCodes =
    "Exit codes: 0 success; 1 failed while running; 2 wrong input or usage; 3 a device or the host\n"
    "refused. Each subcommand has --help.";

/// The error for the first argument that is neither a known subcommand nor a known option, with the
/// nearest known name; empty if every argument is known.
std::string unknown_word(const CLI::App& program, int argc, char** argv) {
  const CLI::App* app = &program;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const bool option = word.starts_with("--");
    std::vector<std::string> names;
    if (option) {
      for (const CLI::Option* const each : app->get_options()) {
        for (const std::string& name : each->get_lnames()) names.push_back("--" + name);
      }
    } else if (!word.starts_with('-')) {
      for (const CLI::App* const each :
           app->get_subcommands([](const CLI::App*) { return true; })) {
        names.push_back(each->get_name());
      }
    }
    const std::string bare = option ? word.substr(0, word.find('=')) : word;
    if (std::find(names.begin(), names.end(), bare) != names.end()) {
      if (!option) app = app->get_subcommand(bare);
      continue;
    }
    // Everything after the last subcommand is one of its arguments.
    if (names.empty() || word == "--") continue;
    const std::string nearest = nearest_name(bare, names);
    const std::string command = app == &program ? "merkel" : "merkel " + app->get_name();
    return std::string("there is no ") + (option ? "option " : "command ") + bare +
           (nearest.empty() ? ": " + command + " --help lists them"
                            : ": did you mean " + nearest + "?");
  }
  return {};
}

/// The parser's message as one sentence, with the command whose help explains it.
std::string sentence_of(const CLI::App& program, const CLI::ParseError& error) {
  std::string command = "merkel";
  const CLI::App* app = &program;
  while (!app->get_subcommands().empty()) {
    app = app->get_subcommands().front();
    command += " " + app->get_name();
  }
  const std::string message = error.what();
  return (message == "A subcommand is required" ? "a command is missing" : message) + ": " +
         command + " --help explains the command line";
}

}  // namespace

CommandLine::CommandLine(CLI::App* app, std::shared_ptr<Choice> choice)
    : app_(app), choice_(std::move(choice)) {}

CommandLine CommandLine::subcommand(const std::string& name, const std::string& what,
                                    const std::string& example) {
  CLI::App* const command = app_->add_subcommand(name, what);
  command->footer("Example: merkel " + example);
  return {command, choice_};
}

void CommandLine::require_subcommand() { app_->require_subcommand(1); }

void CommandLine::runs(std::function<int()> action) {
  app_->callback([app = app_, choice = choice_, action = std::move(action)] {
    if (app->get_subcommands().empty()) choice->action = action;
  });
}

CommandLine& CommandLine::flag(const std::string& name, bool& value, const std::string& help) {
  last_ = app_->add_flag(name, value, help);
  return *this;
}

CommandLine& CommandLine::option(const std::string& name, std::string& value,
                                 const std::string& help) {
  last_ = app_->add_option(name, value, help);
  if (!value.empty()) last_->capture_default_str();
  return *this;
}

CommandLine& CommandLine::option(const std::string& name, double& value, const std::string& help,
                                 Range range) {
  last_ = app_->add_option(name, value, help)
              ->capture_default_str()
              ->check(CLI::Range(range.low, range.high));
  return *this;
}

CommandLine& CommandLine::option(const std::string& name, std::optional<double>& value,
                                 const std::string& help, Range range) {
  last_ = app_->add_option(name, value, help)->check(CLI::Range(range.low, range.high));
  return *this;
}

CommandLine& CommandLine::option(const std::string& name, std::optional<std::uint64_t>& value,
                                 const std::string& help) {
  last_ = app_->add_option(name, value, help);
  return *this;
}

CommandLine& CommandLine::list(const std::string& name, std::vector<std::string>& values,
                               const std::string& help) {
  last_ = app_->add_option(name, values, help)
              ->expected(1)
              ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  return *this;
}

CommandLine& CommandLine::list(const std::string& name, std::vector<double>& values,
                               const std::string& help, Range range, int count) {
  last_ = app_->add_option(name, values, help)
              ->delimiter(',')
              ->check(CLI::Range(range.low, range.high));
  if (count > 0) last_->expected(count);
  return *this;
}

CommandLine& CommandLine::notes(const std::string& text) {
  app_->footer(text + "\n\n" + app_->get_footer());
  return *this;
}

CommandLine& CommandLine::required() {
  last_->required();
  return *this;
}

int run_command_line(int argc, char** argv, const std::function<void(CommandLine&)>& declare) {
  CLI::App program(
      "A real-time bridge from a haptic probe to tactile spikes.\n"
      "Without a device: merkel run --fast --sink csv:spikes.csv",
      "merkel");
  program.set_version_flag("--version",
                           std::string("merkel " MERKEL_VERSION " (") + kGitHash + ")");
  program.footer(kExitCodes);
  CommandLine line(&program, std::make_shared<CommandLine::Choice>());
  line.require_subcommand();
  declare(line);
  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return program.exit(error);
    const std::string unknown = unknown_word(program, argc, argv);
    if (!unknown.empty()) return refuse(unknown);
    return refuse(sentence_of(program, error));
  }
  return line.choice_->action();
}

}  // namespace merkel
