#include "tools/self_test/self_test.hpp"

#include <chrono>
#include <cstdio>
#include <memory>
#include <vector>

#include "core/simd/simd_target.hpp"
#include "core/units.hpp"
#include "tools/commands/command.hpp"
#include "tools/json_text.hpp"
#include "tools/scratch_folder.hpp"

namespace merkel {
namespace {

struct SelfTestOptions {
  bool json = false;
};

int self_test(const SelfTestOptions& options) {
  const ScratchFolder folder("self-test");
  if (!folder.made()) {
    return refuse(SetupError{.kind = SetupError::Kind::kUnavailable,
                             .sentence = "cannot make a temporary folder: free space in /tmp, or "
                                         "name another folder in TMPDIR"});
  }
  const auto started = std::chrono::steady_clock::now();
  bool passed = true;
  bool host_refused = false;
  Json checks = Json::array();
  const auto note = [&](const SelfCheck& check) {
    passed = passed && (check.passed || check.host_refused);
    host_refused = host_refused || check.host_refused;
    checks.push_back({{"what", check.what}, {"passed", check.passed}, {"finding", check.finding}});
    if (options.json) return;
    std::printf("%s %s: %s\n",
                check.passed         ? "passed"
                : check.host_refused ? "not run"
                                     : "FAILED",
                check.what.c_str(), check.finding.c_str());
    std::fflush(stdout);
  };
  for (const std::string& target : simd_targets()) {
    note(check_golden_spikes(target, folder.file("")));
  }
  note(check_loopback_device(folder.file("")));
  const double seconds = units::s_from(std::chrono::steady_clock::now() - started);
  if (options.json) {
    const Json result = {
        {"passed", passed && !host_refused}, {"seconds", seconds}, {"checks", std::move(checks)}};
    std::fputs(json_text(result).c_str(), stdout);
  } else {
    std::printf("%zu checks in %.1f s\n", checks.size(), seconds);
  }
  if (passed && host_refused) {
    return refuse(SetupError{.kind = SetupError::Kind::kUnavailable,
                             .sentence = "the host refused a check, as the lines above say; what "
                                         "could be checked is right"});
  }
  if (passed) return kDone;
  return fail(
      "this copy does not work as built: install it again, and report the lines above if "
      "they stay");
}

}  // namespace

void add_self_test_command(CommandLine& program) {
  auto options = std::make_shared<SelfTestOptions>();
  program
      .subcommand(
          "self-test",
          "Checks an installed program in about ten seconds: the spikes of every preset, with "
          "each instruction set of the processor, are those of the release; a simulated "
          "device is read in real time, recorded and replayed. Exit code 1 if a check fails.",
          "self-test")
      .flag("--json", options->json, "Print the results as JSON")
      .runs([options] { return self_test(*options); });
}

}  // namespace merkel
