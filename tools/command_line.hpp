#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace merkel {

/// The options of the program or of one of its subcommands. Where they are declared, the variables
/// they fill are bound; those must live until the command runs. (The option parser itself is known
/// to command_line.cpp alone: its header takes long to compile.)
class CommandLine {
 public:
  /// The least and the largest value an option takes.
  struct Range {
    double low;
    double high;
  };

  /// Adds a subcommand. \param example  without "merkel"; shown at the end of its --help
  CommandLine subcommand(const std::string& name, const std::string& what,
                         const std::string& example);
  /// Wants one of the subcommands to be given.
  void require_subcommand();
  /// What runs when this subcommand was chosen; returns the exit code.
  void runs(std::function<int()> action);

  /// Names as in "--depth-mm", or as in "scene" for a positional argument.
  CommandLine& flag(const std::string& name, bool& value, const std::string& help);
  CommandLine& option(const std::string& name, std::string& value, const std::string& help);
  CommandLine& option(const std::string& name, double& value, const std::string& help, Range range);
  CommandLine& option(const std::string& name, std::optional<double>& value,
                      const std::string& help, Range range);
  CommandLine& option(const std::string& name, std::optional<std::uint64_t>& value,
                      const std::string& help);
  /// May be given several times.
  CommandLine& list(const std::string& name, std::vector<std::string>& values,
                    const std::string& help);
  /// Numbers separated by commas. \param count  how many; any number, if 0
  CommandLine& list(const std::string& name, std::vector<double>& values, const std::string& help,
                    Range range, int count = 0);
  /// Text at the end of the --help, above the example.
  CommandLine& notes(const std::string& text);
  /// The option declared last must be given.
  CommandLine& required();

 private:
  friend int run_command_line(int argc, char** argv,
                              const std::function<void(CommandLine&)>& declare);
  struct Choice {
    std::function<int()> action;
  };
  CommandLine(CLI::App* app, std::shared_ptr<Choice> choice);

  CLI::App* app_;
  CLI::Option* last_ = nullptr;
  std::shared_ptr<Choice> choice_;
};

/// Parses the command line with what `declare` declares, and runs the chosen subcommand. Returns
/// the exit code: 2 for a wrong command line.
int run_command_line(int argc, char** argv, const std::function<void(CommandLine&)>& declare);

}  // namespace merkel
