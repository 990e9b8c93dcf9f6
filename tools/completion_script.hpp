#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "core/expected.hpp"
#include "tools/command_line.hpp"

namespace merkel {

/// "bash", "fish", "zsh".
[[nodiscard]] std::vector<std::string> completion_shells();

/// Values of options and arguments, by the name of the option or argument.
using CompletionWords = std::map<std::string, std::vector<std::string>>;

/// The script with which a shell completes the words of a command line.
/// Fails for a shell that is not one of completion_shells().
[[nodiscard]] Expected<std::string, SetupError> completion_script(const CommandTree& program,
                                                                  const CompletionWords& words,
                                                                  std::string_view shell);

}  // namespace merkel
