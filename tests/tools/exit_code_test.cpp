#include <gtest/gtest.h>

#include "tests/temporary_folder.hpp"
#include "tests/tools/program.hpp"
#include "tools/command_line.hpp"

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
  expect(
      {{{"run", folder.file("a.toml", "[skin]\npoison_ratio = 1\n")}, 2, "did you mean poisson"},
       {{"run", folder.path("none.toml")}, 2, "cannot read the scene"},
       {{"run", "--fast", "--probe", "replay:" + folder.path("none.csv")}, 2, "cannot read"},
       {{"run", "--seed", "x"}, 2, "--seed"},
       {{"run", "hand", "--fast", "--probe", "sim:ramp"},
        2,
        "the scene has 6 probes, but 1 URI was given: give one for each, in this order: 1 on thumb "
        "(sim:ramp), 2 on index"},
       {{"run", "--probe", "/dev/ttyUSB0"}, 2, "merkel connect /dev/ttyUSB0 recognises"},
       {{"run", "--fast",
         folder.file("e.toml",
                     "[[electrode]]\namplitude_uA = [10, 60]\nfrequency_Hz = [1, 99]\n"
                     "[stimulation]\nmax_charge_nC = 16\nmax_total_uA = 99\nwatchdog_ms = 100\n"
                     "update_ms = 33.333\n")},
        2,
        "the nearest is 33"},
       {{"run", "--fast", "--sink", "cvs:x"}, 2, "csv"}});
}

TEST(ExitCode, Is3WhereADeviceOrTheHostRefused) {
  expect({{{"run", "--probe", "serial:/dev/ttyNONE?protocol=hbf1"}, 3, "there is no device"},
          {{"record", "serial:/dev/ttyNONE?protocol=hbf1", "/tmp/none.csv"},
           3,
           "there is no device"}});
}

TEST(ExitCode, HelpOfARunListsTheSinksOptions) {
  const ProgramRun help = run_program({"run", "--help"});
  EXPECT_NE(help.out.find("view:8080: rate_hz (25), control (0)"), std::string::npos) << help.out;
  EXPECT_NE(help.out.find("phy:DIR: sample_rate (1000000), time"), std::string::npos) << help.out;
}

TEST(ExitCode, HelpListsTheCodes) {
  const ProgramRun help = run_program({"--help"});
  EXPECT_NE(help.out.find("3 a device or the host"), std::string::npos) << help.out;
}

TEST(CommandLineOptions, TakeOneValueAndNameTheirLimits) {
  expect({{{"run", "--fast", "--sink", "csv:/dev/null", "goodwim"}, 2, "did you mean goodwin?"},
          {{"run", "--fast", "--seed", "-1"},
           2,
           "must be a whole number from 0 to 9223372036854775807, but is -1"},
          {{"run", "--fast", "--seed", "9223372036854775808"}, 2, "to 9223372036854775807, but is"},
          {{"run", "--fast", "--seed", "99999999999999999999"}, 2, "but is 99999999999999999999"},
          {{"run", "--fast", "--seed", "0x10"}, 2, "but is 0x10"},
          {{"run", "--fast", "--duration-s", "inf"}, 2, "must be from 1e-06 to 1e+09, but is inf"},
          {{"run", "--fast", "--record", ""}, 2, "--record: must not be empty"},
          {{"run", "", "--fast"}, 2, "scene: must not be empty"},
          {{"batch", "jobs.csv", "--out", ""}, 2, "--out: must not be empty"},
          {{"run", "paper", "extra"}, 2, "unexpected argument: extra"},
          {{"bench", "--step-us", "0"}, 2, "--step-us: must be from 0.1 to 1000, but is 0"},
          {{"bench", "--step-us", "x"}, 2, "--step-us: must be a number, but is x"}});
}

// The parser of Debian 13 refuses this at start, that of Debian 12 does not.
TEST(CommandLineOptions, DoNotShareTheNameOfAnArgumentAboveThem) {
  std::string scene;
  const auto declare = [&](const std::string& name) {
    std::vector<std::string> words{"merkel", "fit", "skin"};
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    return run_command_line(3, arguments.data(), [&](CommandLine& program) {
      CommandLine fit = program.subcommand("fit", "", "fit");
      fit.option("scene", scene, "");
      CommandLine skin = fit.subcommand("skin", "", "fit skin");
      skin.option(name, scene, "").runs([] { return 7; });
    });
  };
  EXPECT_EQ(declare("scene"), 7);
  EXPECT_EQ(declare("--trace"), 7);
  EXPECT_THROW(declare("--scene"), std::logic_error);
}

TEST(MistypedWords, AreAnsweredWithTheNearestOne) {
  expect({{{"rnu"}, 2, "there is no command rnu: did you mean run?"},
          {{"inspekt", "neuron"}, 2, "did you mean inspect?"},
          {{"inspect", "neurn"}, 2, "did you mean neuron?"},
          {{"xyzzy"}, 2, "there is no command xyzzy: merkel --help lists them"},
          {{"fit", "skin", "--qqqqqq"},
           2,
           "there is no option --qqqqqq: merkel fit skin --help lists them"},
          {{"run", "--fats"}, 2, "there is no option --fats: did you mean --fast?"},
          {{"run", "--prob=sim:ramp"}, 2, "did you mean --probe?"},
          {{"run", "goodwim"}, 2, "did you mean goodwin?"},
          {{"plan", "papper"}, 2, "did you mean paper?"},
          {{"scene", "zzz"}, 2, "merkel scene --list prints the presets"}});
}

}  // namespace
}  // namespace merkel
