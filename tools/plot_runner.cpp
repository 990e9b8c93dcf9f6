#include "tools/plot_runner.hpp"

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string_view>

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

namespace merkel {

/// Name and text of a plot script; the table is generated from tools/plots/*.py.
struct PlotScript {
  const char* name;
  const char* text;
};
extern const PlotScript kPlotScripts[];
extern const std::size_t kPlotScriptCount;

namespace {

/// Debian's own interpreter first: its packages are not seen by others.
const char* python() {
  constexpr const char* kDebian = "/usr/bin/python3";
  return ::access(kDebian, X_OK) == 0 ? kDebian : "python3";
}

/// Exits 0 where matplotlib is there, quietly.
constexpr const char* kProbe =
    "import importlib.util, sys; sys.exit(importlib.util.find_spec('matplotlib') is None)";

/// Runs a program; its exit code, or -1 where it could not be started or was killed.
int run_and_wait(std::array<const char*, 4> arguments) {
  std::array<char*, 5> argv{};
  for (std::size_t i = 0; i < arguments.size(); ++i) argv[i] = const_cast<char*>(arguments[i]);
  pid_t child = 0;
  if (::posix_spawnp(&child, argv[0], nullptr, nullptr, argv.data(), environ) != 0) return -1;
  int status = 0;
  while (::waitpid(child, &status, 0) < 0) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace

Expected<void, SetupError> draw_plots(const std::string& script, const std::string& folder) {
  namespace fs = std::filesystem;
  if (run_and_wait({python(), "-c", kProbe, nullptr}) != 0) {
    return unavailable("the tables are written to " + folder +
                       ", but not drawn: install python3-matplotlib and run again");
  }
  std::string pattern = (fs::temp_directory_path() / "merkel-plots-XXXXXX").string();
  if (::mkdtemp(pattern.data()) == nullptr) {
    return unavailable("cannot make a temporary folder for the plot scripts");
  }
  for (std::size_t i = 0; i < kPlotScriptCount; ++i) {
    std::ofstream(fs::path(pattern) / kPlotScripts[i].name) << kPlotScripts[i].text;
  }
  const std::string path = (fs::path(pattern) / (script + ".py")).string();
  const int code = run_and_wait({python(), path.c_str(), folder.c_str(), nullptr});
  std::error_code ignored;
  fs::remove_all(pattern, ignored);
  if (code != 0) return unavailable("the tables in " + folder + " could not be drawn: see above");
  return {};
}

}  // namespace merkel
