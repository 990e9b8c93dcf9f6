#include "tools/command_line.hpp"

#include <algorithm>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/core.h>

#include "core/parameters/field.hpp"
#include "core/parameters/nearest_name.hpp"
#include "drivers/parsed_number.hpp"
#include "tools/exit_code.hpp"
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
  std::string command = "merkel";
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
      if (!option) {
        app = app->get_subcommand(bare);
        command += " " + bare;
      }
      continue;
    }
    // Everything after the last subcommand is one of its arguments.
    if (names.empty() || word == "--") continue;
    return std::string("there is no ") + (option ? "option " : "command ") + bare +
           did_you_mean(bare, names, ": " + command + " --help lists them");
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
  std::string message = error.what();
  if (message == "A subcommand is required") message = "a command is missing";
  if (dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr) {
    message = "unexpected argument" + message.substr(std::min(message.find(':'), message.size()));
  }
  return message + ": " + command + " --help explains the command line";
}

/// An option beside or below a positional argument of the same name is ambiguous: newer versions of
/// the parser refuse it at start, older ones do not. A fault of the program, found by its first
/// start.
void check_name(const CLI::App& app, const std::string& name) {
  const bool positional = !name.starts_with("-");
  const std::string other =
      positional ? "--" + name : name.substr(std::min<std::size_t>(2, name.size()));
  for (const CLI::App* each : {&app, app.get_parent()}) {
    if (each == nullptr || (positional && each != &app)) continue;
    if (other.empty() || each->get_option_no_throw(other) == nullptr) continue;
    throw std::logic_error(app.get_name() + ": " + name + " and " + other + " of " +
                           each->get_name() + " have the same name");
  }
}

/// An empty text is a variable of a script that is not set: no file or address has that name.
std::string fault_of_text(const std::string& text) {
  return text.empty() ? "must not be empty" : "";
}

/// A whole number in decimals: the parser's own conversion reads 010 as 8, and limits what is too
/// large.
template <class Whole>
CLI::Option* add_whole(CLI::App& app, const std::string& name, std::optional<Whole>& value,
                       const std::string& help, Whole least, Whole most) {
  return app
      .add_option_function<std::string>(
          name, [&value](const std::string& text) { value = parsed_number<Whole>(text); }, help)
      ->type_name("UINT")
      ->check([least, most](const std::string& text) -> std::string {
        const auto number = parsed_number<Whole>(text);
        if (number && *number >= least && *number <= most) return {};
        return fmt::format("must be a whole number from {} to {}, but is {}", least, most, text);
      });
}

/// Limits of 1e9 and more only keep out what no user means: they are not shown.
CLI::Validator in_range(CommandLine::Range range) {
  std::string limits;
  if (range.low > -1e9) limits = fmt::format("from {:g}", range.low);
  if (range.high < 1e9)
    limits += fmt::format("{}to {:g}", limits.empty() ? "up " : " ", range.high);
  return {[range, limits](const std::string& text) -> std::string {
            char* end = nullptr;
            const double value = std::strtod(text.c_str(), &end);
            if (text.empty() || *end != '\0') return "must be a number, but is " + text;
            if (value >= range.low && value <= range.high) return {};
            return fmt::format("must be from {:g} to {:g}, but is {}", range.low, range.high, text);
          },
          limits};
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
  check_name(*app_, name);
  last_ = app_->add_flag(name, value, help);
  return *this;
}

CommandLine& CommandLine::option(const std::string& name, std::string& value,
                                 const std::string& help) {
  check_name(*app_, name);
  last_ = app_->add_option(name, value, help)->check(fault_of_text);
  if (!value.empty()) last_->capture_default_str();
  return *this;
}

CommandLine& CommandLine::option(const std::string& name, double& value, const std::string& help,
                                 Range range) {
  check_name(*app_, name);
  last_ = app_->add_option(name, value, help)->capture_default_str()->check(in_range(range));
  return *this;
}

CommandLine& CommandLine::option(const std::string& name, std::optional<double>& value,
                                 const std::string& help, Range range) {
  check_name(*app_, name);
  last_ = app_->add_option(name, value, help)->check(in_range(range));
  return *this;
}

CommandLine& CommandLine::option(const std::string& name, std::optional<std::uint64_t>& value,
                                 const std::string& help) {
  check_name(*app_, name);
  last_ = add_whole<std::uint64_t>(*app_, name, value, help, 0, kMaxSeed);
  return *this;
}

CommandLine& CommandLine::option(const std::string& name, std::optional<std::uint32_t>& value,
                                 const std::string& help, Range range) {
  check_name(*app_, name);
  last_ = add_whole(*app_, name, value, help, static_cast<std::uint32_t>(range.low),
                    static_cast<std::uint32_t>(range.high));
  return *this;
}

CommandLine& CommandLine::list(const std::string& name, std::vector<std::string>& values,
                               const std::string& help) {
  check_name(*app_, name);
  last_ =
      app_->add_option(name, values, help)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  if (name.starts_with('-')) {
    last_->expected(1)->allow_extra_args(false);  // else it takes the scene that follows, too
  }
  return *this;
}

CommandLine& CommandLine::list(const std::string& name, std::vector<double>& values,
                               const std::string& help, Range range, int count) {
  check_name(*app_, name);
  last_ = app_->add_option(name, values, help)->delimiter(',')->check(in_range(range));
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

void CommandLine::completes(std::function<int(const CommandTree&, std::span<char* const>)> answer) {
  choice_->complete = std::move(answer);
}

CommandTree CommandLine::tree() const {
  CommandTree tree{.name = app_->get_name(), .what = app_->get_description()};
  for (const CLI::Option* const option : app_->get_options()) {
    const bool argument = option->get_positional();
    if (!argument && option->get_lnames().empty()) continue;
    const bool text = option->get_type_name() == "TEXT";
    const auto value = text ? CommandTree::Value::kText : CommandTree::Value::kNumber;
    tree.options.push_back(
        {.name = argument ? option->get_name(true) : "--" + option->get_lnames().front(),
         .help = option->get_description(),
         .value = option->get_expected_max() == 0 ? CommandTree::Value::kNone : value});
  }
  for (CLI::App* const command : app_->get_subcommands([](const CLI::App*) { return true; })) {
    tree.commands.push_back(CommandLine(command, choice_).tree());
  }
  return tree;
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
  if (argc > 1 && std::string_view(argv[1]) == "__complete") {
    return after_output(line.choice_->complete(line.tree(), {argv + 2, argv + argc}));
  }
  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return after_output(program.exit(error));
    const std::string unknown = unknown_word(program, argc, argv);
    if (!unknown.empty()) return refuse(unknown);
    return refuse(sentence_of(program, error));
  }
  return after_output(line.choice_->action());
}

}  // namespace merkel
