#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace merkel {

/// The commands and options of a command line, as declared.
struct CommandTree {
  enum class Value { kNone, kNumber, kText };
  struct Option {
    std::string name;  ///< "--depth-mm", or "scene" for a positional argument
    std::string help;
    Value value = Value::kNone;
  };
  std::string name;  ///< "--depth-mm", or "scene" for a positional argument
  std::string what;
  std::vector<Option> options = {};
  std::vector<CommandTree> commands = {};
};

/// The options of the program or of one of its subcommands. An option is bound to the variable that
/// it sets; the variable must live until the command runs. (Only command_line.cpp includes the
/// option parser, whose header is slow to compile.)
class CommandLine {
 public:
  /// The smallest and the largest value of an option.
  struct Range {
    double low;
    double high;
  };

  /// Adds a subcommand. \param example  without "merkel"; shown at the end of its --help
  CommandLine subcommand(const std::string& name, const std::string& what,
                         const std::string& example);
  /// Makes a subcommand mandatory.
  void require_subcommand();
  /// Sets the action of this subcommand. \param action  returns the exit code
  void runs(std::function<int()> action);

  /// Names as in "--depth-mm", or as in "scene" for a positional argument.
  CommandLine& flag(const std::string& name, bool& value, const std::string& help);
  CommandLine& option(const std::string& name, std::string& value, const std::string& help);
  CommandLine& option(const std::string& name, double& value, const std::string& help, Range range);
  CommandLine& option(const std::string& name, std::optional<double>& value,
                      const std::string& help, Range range);
  CommandLine& option(const std::string& name, std::optional<std::uint64_t>& value,
                      const std::string& help);
  CommandLine& option(const std::string& name, std::optional<std::uint32_t>& value,
                      const std::string& help, Range range);
  /// An option that can be repeated, or all positional arguments.
  CommandLine& list(const std::string& name, std::vector<std::string>& values,
                    const std::string& help);
  /// Numbers separated by commas. \param count  how many; 0: any number
  CommandLine& list(const std::string& name, std::vector<double>& values, const std::string& help,
                    Range range, int count = 0);
  /// Text at the end of the --help, above the example.
  CommandLine& notes(const std::string& text);
  /// Makes the option declared last mandatory.
  CommandLine& required();
  /// Sets what answers to "merkel __complete WORDS…". \return the exit code
  void completes(
      std::function<int(const CommandTree& program, std::span<char* const> words)> answer);

 private:
  friend int run_command_line(int argc, char** argv,
                              const std::function<void(CommandLine&)>& declare);
  struct Choice {
    std::function<int()> action;
    std::function<int(const CommandTree&, std::span<char* const>)> complete;
  };
  CommandLine(CLI::App* app, std::shared_ptr<Choice> choice);
  /// What has been declared so far, with everything below.
  [[nodiscard]] CommandTree tree() const;

  CLI::App* app_;
  CLI::Option* last_ = nullptr;
  std::shared_ptr<Choice> choice_;
};

/// Parses the command line with the options that `declare` declares, and runs the chosen
/// subcommand. Returns the exit code: 2 if the command line is wrong.
int run_command_line(int argc, char** argv, const std::function<void(CommandLine&)>& declare);

}  // namespace merkel
