#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/temporary_folder.hpp"
#include "tests/tools/program.hpp"

namespace merkel {
namespace {

TEST(Compare, FindsSessionsCsvAndNwbEqual) {
  const TemporaryFolder folder;
  const std::string csv = folder.path("s.csv");
  std::vector<std::string> run = {
      "run", "finger", "--fast", "--probe", "replay:tests/traces/taps.csv", "--sink", "csv:" + csv};
  const std::vector<std::string> others = {"xdf:" + folder.path("s.xdf"),
                                           "nwb:" + folder.path("s.nwb")};
  for (const std::string& uri : others) run.insert(run.end(), {"--sink", uri});
  const ProgramRun made = run_program(run);
  ASSERT_EQ(made.exit_code, 0) << made.err;
  for (const std::string& uri : others) {
    const std::string file = uri.substr(uri.find(':') + 1);
    const ProgramRun same = run_program({"compare", csv, file, "--within-us", "0.6", "--json"});
    EXPECT_EQ(same.exit_code, 0) << uri << same.out << same.err;
    const auto json = nlohmann::json::parse(same.out);
    EXPECT_GT(json["matched"], 50);
    EXPECT_EQ(json["only_in_a"], 0);
  }
}

TEST(Compare, MatchesWithinATolerance) {
  const TemporaryFolder folder;
  const std::string a = folder.file("a.csv", "time_s,neuron\n0.1,1\n0.2,1\n0.3,2\n");
  const std::string b =
      folder.file("b.csv", "# a note\ntime_s,neuron\n0.1000005,1\n0.2000020,1\n0.3,3\n");
  const ProgramRun near = run_program({"compare", a, b});
  EXPECT_EQ(near.exit_code, 1);
  EXPECT_EQ(near.out,
            "1 spikes in both within 1 µs, rms 0.500 µs, largest 0.500 µs\nonly in " + a +
                ": 2\n  neuron 1 at 0.200000000 s\n  neuron 2 at 0.300000000 s\nonly in " + b +
                ": 2\n  neuron 1 at 0.200002000 s\n  neuron 3 at 0.300000000 s\ndifferent\n");
  EXPECT_EQ(run_program({"compare", a, a, "--within-us", "0"}).exit_code, 0);
  EXPECT_NE(run_program({"compare", a, b, "--within-us", "3"}).out.find("2 spikes in both"),
            std::string::npos);
}

TEST(Compare, CountsTimesFromTheStartOfTheRun) {
  const TemporaryFolder folder;
  const std::string a = folder.file("a.csv", "time_s,neuron\n0.1,1\n");
  const std::string b = folder.file("b.csv", "time_s,neuron\n5.1,1\n");
  EXPECT_EQ(run_program({"compare", a, b}).exit_code, 1);
  static_cast<void>(folder.file("a.csv.time",
                                "time_zero = run\ntime_offset_ns = 5000000000\n"
                                "start_device_ns = 5000000000\n"));
  static_cast<void>(
      folder.file("b.csv.time", "time_offset_ns = 0\nstart_device_ns = 5000000000\n"));
  EXPECT_EQ(run_program({"compare", a, b}).exit_code, 0);
}

constexpr const char* kCommands =
    "time_s,electrode,kind,amplitude_uA,frequency_Hz,heartbeat,stop\n";

TEST(CompareStimulation, ReportsDifferencesInAmplitudeFrequencyAndStop) {
  const TemporaryFolder folder;
  const std::string a =
      folder.file("a.csv", std::string(kCommands) + "0.01,E1,update,20,80,1,\n" +
                               "0.01,E2,update,30,90,1,\n0.015,E2,pulse,50,0,1,\n" +
                               "0.02,E1,update,0,0,2,released\n0.02,E2,update,30,90,2,\n");
  const std::string b = folder.file(
      "b.csv", "# a note\n" + std::string(kCommands) + "0.0100005,E1,update,20.5,80,1,\n" +
                   "0.01,E2,update,30,93,1,\n0.0150021,E2,pulse,50,0,1,\n" +
                   "0.02,E1,update,0,0,2,gap\n0.02,E2,update,30,90,2,\n");
  const ProgramRun run = run_program({"compare", a, b});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_EQ(run.out,
            "4 stimulation commands in both, rms 0.250 µs, largest 0.500 µs; amplitudes differ by "
            "at most 0.5 µA, frequencies by 3 Hz\n"
            "different: 3\n"
            "  E1 at 0.010000000 s: 20 µA, 80 Hz against 20.5 µA, 80 Hz\n"
            "  E2 at 0.010000000 s: 30 µA, 90 Hz against 30 µA, 93 Hz\n"
            "  E1 at 0.020000000 s: 0 µA, 0 Hz (stop: released) against 0 µA, 0 Hz (stop: gap)\n"
            "only in " +
                a +
                ": 1\n  E2 at 0.015000000 s: pulse, 50 µA, 0 Hz\n"
                "only in " +
                b + ": 1\n  E2 at 0.015002100 s: pulse, 50 µA, 0 Hz\ndifferent\n");
  EXPECT_EQ(run_program({"compare", a, a, "--within-us", "0"}).exit_code, 0);
  const ProgramRun within = run_program(
      {"compare", a, b, "--within-us", "3", "--within-uA", "0.5", "--within-Hz", "3", "--json"});
  EXPECT_EQ(within.exit_code, 1);
  const auto json = nlohmann::json::parse(within.out);
  EXPECT_FALSE(json["equal"]);
  EXPECT_FALSE(json.contains("matched"));
  EXPECT_EQ(json["commands"]["matched"], 5);
  EXPECT_EQ(json["commands"]["different"], 1);  // the reason to stop
  EXPECT_EQ(json["commands"]["only_in_a"], 0);
  EXPECT_EQ(json["commands"]["largest_amplitude_uA"], 0.5);
  EXPECT_EQ(json["commands"]["largest_frequency_Hz"], 3.0);
}

TEST(CompareStimulation, CommandsThatLeftAtOtherTimesDiffer) {
  const TemporaryFolder folder;
  const std::string header =
      "time_s,electrode,kind,amplitude_uA,frequency_Hz,heartbeat,stop,sent_monotonic_ns,"
      "valid_until_ns\n";
  const auto file = [&](const std::string& name, const std::string& sent) {
    return folder.file(name, header + "0.01,E1,update,20,80,1,,71000000,131000000\n" +
                                 "0.02,E1,update,30,80,2,," + sent + ",141000000\n");
  };
  const std::string a = file("a.csv", "81000000");
  EXPECT_EQ(run_program({"compare", a, file("b.csv", "81000000")}).exit_code, 0);
  const ProgramRun other = run_program({"compare", a, file("c.csv", "81000001")});
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_NE(other.out.find("E1 at 0.020000000 s: 30 µA, 80 Hz, sent at 81000000 ns against 30 µA, "
                           "80 Hz, sent at 81000001 ns"),
            std::string::npos)
      << other.out;
  // A file of an older version has no such times, and one of a virtual clock has 0.
  const std::string older = folder.file(
      "o.csv", std::string(kCommands) + "0.01,E1,update,20,80,1,\n0.02,E1,update,30,80,2,\n");
  EXPECT_EQ(run_program({"compare", a, older}).exit_code, 0);
  EXPECT_EQ(run_program({"compare", a, file("v.csv", "0")}).exit_code, 0);
  EXPECT_EQ(run_program({"compare", a, file("n.csv", "-1")}).exit_code, 2);
}

TEST(CompareStimulation, FindsTheCommandsOfARunItsSessionAndItsReplayEqual) {
  const TemporaryFolder folder;
  const std::string electrodes =
      "preset = \"paper\"\n"
      "[stimulation]\nmax_charge_nC = 20\nmax_total_uA = 300\nwatchdog_ms = 100\n"
      "[[electrode]]\nname = \"E1\"\nfield_mm = [15, 10, 15]\namplitude_uA = [20, 80]\n"
      "frequency_Hz = [0, 200]\n"
      "[[electrode]]\nname = \"E2\"\nencoder = \"pulse_per_spike\"\nfield_mm = [15, 10, 15]\n"
      "frequency_Hz = [0, 200]\namplitude_uA = [20, ";
  const auto run = [&](const std::string& name, const std::string& strongest_uA) {
    const ProgramRun made = run_program(
        {"run", folder.file(name + ".toml", electrodes + strongest_uA + "]\n"), "--fast", "--probe",
         "replay:tests/traces/taps.csv", "--sink", "stim-csv:" + folder.path(name + ".csv"),
         "--sink", "xdf:" + folder.path(name + ".xdf")});
    EXPECT_EQ(made.exit_code, 0) << made.err;
  };
  run("a", "60");
  run("b", "50");
  const auto compare = [&](const std::string& x, const std::string& y) {
    return run_program({"compare", folder.path(x), folder.path(y), "--within-us", "0"});
  };
  for (const auto& [x, y] : {std::pair("a.csv", "a.xdf"), std::pair("a.xdf", "a.csv")}) {
    const ProgramRun same = compare(x, y);
    EXPECT_EQ(same.exit_code, 0) << same.out << same.err;
    EXPECT_NE(same.out.find(" stimulation commands in both"), std::string::npos) << same.out;
    EXPECT_EQ(same.out.find(" spikes in both"), std::string::npos) << same.out;
  }
  // Sessions of the same press: the same spikes, other commands.
  const ProgramRun sessions = compare("a.xdf", "b.xdf");
  EXPECT_EQ(sessions.exit_code, 1);
  EXPECT_NE(sessions.out.find(" spikes in both"), std::string::npos) << sessions.out;
  EXPECT_EQ(sessions.out.find("only in"), std::string::npos) << sessions.out;
  EXPECT_NE(sessions.out.find("60 µA, 0 Hz against 50 µA, 0 Hz"), std::string::npos)
      << sessions.out;
  EXPECT_EQ(compare("a.xdf", "a.xdf").exit_code, 0);
  EXPECT_EQ(compare("a.csv", "b.csv").exit_code, 1);
}

TEST(CompareStimulation, RefusesFilesWithoutCommands) {
  const TemporaryFolder folder;
  const std::string commands = folder.file("c.csv", kCommands);
  EXPECT_EQ(run_program({"compare", commands, commands}).exit_code, 0);
  const ProgramRun spikes =
      run_program({"compare", commands, folder.file("s.csv", "time_s,neuron\n0.1,1\n")});
  EXPECT_EQ(spikes.exit_code, 2);
  EXPECT_NE(spikes.err.find("s.csv has no stimulation commands"), std::string::npos) << spikes.err;
  const ProgramRun damaged = run_program(
      {"compare", commands, folder.file("d.csv", std::string(kCommands) + "0.1,E1,up,1,1,1,\n")});
  EXPECT_EQ(damaged.exit_code, 2);
  EXPECT_NE(damaged.err.find("d.csv:2: this is not a stimulation command"), std::string::npos)
      << damaged.err;
}

TEST(Compare, RefusesWhatItCannotRead) {
  const TemporaryFolder folder;
  const std::string a = folder.file("a.csv", "time_s,neuron\n0.1,1\n");
  for (const auto& [content, sentence] :
       {std::pair("time_s,neuron\n0.1,0\n", "b:2: this is not a spike"),
        std::pair("hello\n", "b:1: this is not a spike"), std::pair("XDF:x", "is damaged"),
        std::pair("\x89HDF\r\n\x1a\nrubbish", "HDF5 refused")}) {
    const ProgramRun run = run_program({"compare", a, folder.file("b", content)});
    EXPECT_EQ(run.exit_code, 2) << run.out;
    EXPECT_NE(run.err.find(sentence), std::string::npos) << run.err;
  }
  EXPECT_EQ(run_program({"compare", a, folder.path("none.csv")}).exit_code, 2);
  EXPECT_EQ(run_program({"compare", a}).exit_code, 2);
}

}  // namespace
}  // namespace merkel
