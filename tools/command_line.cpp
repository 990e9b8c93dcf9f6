#include "tools/command_line.hpp"

#include <string>
#include <utility>

#include <CLI/CLI.hpp>

#include "tools/commands/command.hpp"
#include "tools/run/machine_facts.hpp"

namespace merkel {

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
  app_->callback([choice = choice_, action = std::move(action)] { choice->action = action; });
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
  CommandLine line(&program, std::make_shared<CommandLine::Choice>());
  line.require_subcommand();
  declare(line);
  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return program.exit(error) == 0 ? kDone : kWrongInput;
  }
  return line.choice_->action();
}

}  // namespace merkel
