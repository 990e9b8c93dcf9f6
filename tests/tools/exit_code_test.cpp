#include <gtest/gtest.h>

#include "tests/temporary_folder.hpp"
#include "tests/tools/program.hpp"

namespace merkel {
namespace {

struct Case {
  std::vector<std::string> arguments;
  int code;
  std::string sentence;  ///< part of what is printed on stderr
};

void expect(const std::vector<Case>& cases) {
  for (const Case& each : cases) {
    const ProgramRun run = run_program(each.arguments);
    EXPECT_EQ(run.exit_code, each.code) << each.sentence << "\n" << run.err;
    EXPECT_NE(run.err.find(each.sentence), std::string::npos) << run.err;
  }
}

TEST(ExitCode, Is0OnSuccess) {
  expect({{{"run", "--fast", "--duration-s", "0.1"}, 0, ""},
          {{"--version"}, 0, ""},
          {{"run", "--help"}, 0, ""},
          {{"scene", "hand"}, 0, ""}});
}

TEST(ExitCode, Is1WhereTheRunFailed) {
  expect({{{"run", "--fast", "--sink", "csv:/dev/full"}, 1, "No space left"},
          {{"inspect", "neuron", "--current", "10", "--method", "rk4", "--step-us", "200"},
           1,
           "reduce --step-us"}});
}

TEST(ExitCode, Is2ForWrongInputOrUsage) {
  const TemporaryFolder folder;
  expect({{{"run", folder.file("a.toml", "[skin]\npoison_ratio = 1\n")}, 2, "did you mean poisson"},
          {{"run", folder.path("none.toml")}, 2, "cannot read the scene"},
          {{"run", "--fast", "--probe", "replay:" + folder.path("none.csv")}, 2, "cannot read"},
          {{"run", "--seed", "x"}, 2, "--seed"},
          {{"run", "--fast", "--sink", "cvs:x"}, 2, "csv"}});
}

TEST(ExitCode, Is3WhereADeviceOrTheHostRefused) {
  expect({{{"run", "--probe", "serial:/dev/ttyNONE?protocol=hbf1"}, 3, "there is no device"},
          {{"record", "serial:/dev/ttyNONE?protocol=hbf1", "/tmp/none.csv"},
           3,
           "there is no device"}});
}

TEST(ExitCode, HelpListsTheCodes) {
  const ProgramRun help = run_program({"--help"});
  EXPECT_NE(help.out.find("3 a device or the host"), std::string::npos) << help.out;
}

TEST(CommandLineOptions, TakeOneValueAndNameTheirLimits) {
  expect({{{"run", "--fast", "--sink", "csv:/dev/null", "goodwim"}, 2, "did you mean goodwin?"},
          {{"run", "--fast", "--seed", "-1"}, 2, "must be a whole number from 0 on, but is -1"},
          {{"run", "paper", "extra"}, 2, "unexpected argument: extra"},
          {{"bench", "--step-us", "0"}, 2, "--step-us: must be from 0.1 to 1000, but is 0"},
          {{"bench", "--step-us", "x"}, 2, "--step-us: must be a number, but is x"}});
}

TEST(MistypedWords, AreAnsweredWithTheNearestOne) {
  expect({{{"rnu"}, 2, "there is no command rnu: did you mean run?"},
          {{"inspekt", "neuron"}, 2, "did you mean inspect?"},
          {{"inspect", "neurn"}, 2, "did you mean neuron?"},
          {{"xyzzy"}, 2, "there is no command xyzzy: merkel --help lists them"},
          {{"run", "--fats"}, 2, "there is no option --fats: did you mean --fast?"},
          {{"run", "--prob=sim:ramp"}, 2, "did you mean --probe?"},
          {{"run", "goodwim"}, 2, "did you mean goodwin?"},
          {{"plan", "papper"}, 2, "did you mean paper?"},
          {{"scene", "zzz"}, 2, "the presets are paper"}});
}

}  // namespace
}  // namespace merkel
