#include "tools/studies/report/plot_runner.hpp"

#include <fstream>
#include <vector>

#include <unistd.h>

#include "drivers/files/embedded_text.hpp"
#include "tools/child_process.hpp"
#include "tools/scratch_folder.hpp"

namespace merkel {

extern const std::span<const EmbeddedText> kPlotScripts;  ///< tools/plots/*.py
namespace {

/// Prefers Debian's interpreter, because other ones do not see Debian's packages.
const char* python() {
  constexpr const char* kDebian = "/usr/bin/python3";
  return ::access(kDebian, X_OK) == 0 ? kDebian : "python3";
}

/// Runs a program. \return its exit code, or -1 if it did not start or was killed
int run_and_wait(const std::vector<std::string>& arguments) {
  return ChildProcess(arguments, ChildProcess::Output::kInherited).wait();
}

}  // namespace

bool python_has(const std::string& module) {
  return run_and_wait({python(), "-c",
                       "import importlib.util, sys; "
                       "sys.exit(importlib.util.find_spec(sys.argv[1]) is None)",
                       module}) == 0;
}

Expected<void, SetupError> run_script(const std::string& script,
                                      const std::vector<std::string>& arguments) {
  const ScratchFolder folder("plots");
  if (!folder.made()) return unavailable("cannot make a temporary folder for the plot scripts");
  for (const EmbeddedText& file : kPlotScripts) {
    std::ofstream(folder.file(std::string(file.name))) << file.text;
  }
  std::vector<std::string> command = {python(), folder.file(script + ".py")};
  command.insert(command.end(), arguments.begin(), arguments.end());
  const int code = run_and_wait(command);
  if (code != 0) return unavailable("the script " + script + ".py failed: see above");
  return {};
}

Expected<void, SetupError> draw_plots(const std::string& script, const std::string& folder) {
  if (!python_has("matplotlib")) {
    return unavailable("wrote the tables to " + folder +
                       ", but no pictures: install python3-matplotlib and run again");
  }
  return run_script(script, {folder});
}

}  // namespace merkel
