// Stopping the stimulation of a run by hand: a signal, the terminal.
#include "tools/run/stimulation_control.hpp"

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "tests/temporary_folder.hpp"
#include "tests/text_has.hpp"
#include "tests/tools/program.hpp"
#include "tests/tools/terminal.hpp"

namespace merkel {
namespace {

constexpr auto kGrasp = R"(preset = "goodwin"
[probe]
uri = "sim:ramp?wait_s=0&hold_s=600&live=1"
[[electrode]]
name = "E1"
field_mm = [15, 10, 4]
encoder = "linear"
full_force_N = 0.1
amplitude_uA = [20, 80]
frequency_Hz = [0, 200]
[stimulation]
update_ms = 10
max_charge_nC = 16
max_total_uA = 300
max_slope_uA_per_s = 1000
watchdog_ms = 200
)";

/// Waits until a file has a row with a text.
bool wait_for_row(const std::string& file, const std::string& text) {
  for (int i = 0; i < 3000; ++i) {
    if (std::filesystem::exists(file) && has(read_file(file), text)) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds{10});
  }
  return false;
}

/// The rows of a stim-csv file: amplitude and reason.
std::vector<std::pair<double, std::string>> amplitudes_and_stops(const std::string& file) {
  std::istringstream lines(read_file(file));
  std::vector<std::pair<double, std::string>> rows;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with('#') || line.starts_with("time_s")) continue;
    std::vector<std::string> fields;
    std::istringstream in(line);
    for (std::string field; std::getline(in, field, ',');) fields.push_back(field);
    fields.resize(9);
    rows.emplace_back(std::stod(fields[3]), fields[6]);
  }
  return rows;
}

TEST(StimulationControl, SigusrSwitchesOffForTheRestOfTheRunAndTheSummarySaysSo) {
  const TemporaryFolder folder;
  const std::string scene = folder.file("scene.toml", kGrasp);
  const std::string csv = folder.path("c.csv");
  const std::string session = folder.path("s.xdf");
  StartedProgram program({"run", scene, "--sink", "stim-csv:" + csv, "--sink", "xdf:" + session});
  ASSERT_TRUE(wait_for_row(csv + ".part", ",80,"));
  program.send(SIGUSR1);
  ASSERT_TRUE(wait_for_row(csv + ".part", ",stopped"));
  program.send(SIGUSR1);  // a second one changes nothing
  std::this_thread::sleep_for(std::chrono::milliseconds{100});
  program.send(SIGINT);
  const ProgramRun run = program.finish();
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_TRUE(has(run.err, "stimulation stopped by SIGUSR1: all electrodes are off")) << run.err;
  EXPECT_TRUE(has(run.out, "stimulation was stopped by SIGUSR1 after ")) << run.out;
  bool stopped = false;
  for (const auto& [amplitude_uA, stop] : amplitudes_and_stops(csv)) {
    stopped = stopped || stop == "stopped";
    EXPECT_TRUE(!stopped || amplitude_uA == 0.0);
  }
  EXPECT_TRUE(stopped);
  const ProgramRun marks = run_program({"inspect", "session", session, "--stream", "marks"});
  EXPECT_TRUE(has(marks.out, "stimulation stopped by SIGUSR1")) << marks.out << marks.err;
  EXPECT_EQ(run_program({"replay", session}).exit_code, 0);
  // The session holds what the receiver got, with the times, unless a busy machine delayed the
  // sink.
  const std::string sent = run_program({"inspect", "session", session, "--stream", "sent"}).out;
  EXPECT_TRUE(has(sent, ",sent_monotonic_s,valid_until_s,refused_by\n")) << sent.substr(0, 200);
  EXPECT_TRUE(has(sent, ",stopped,"));
  if (has(sent, ",1\n")) return;
  const ProgramRun same = run_program({"compare", csv, session, "--within-us", "0"});
  EXPECT_EQ(same.exit_code, 0) << same.out << same.err;
  const std::string exported = folder.path("e.csv");
  EXPECT_EQ(run_program({"export", session, "--sink", "stim-csv:" + exported}).exit_code, 0);
  EXPECT_EQ(run_program({"compare", csv, exported, "--within-us", "0"}).exit_code, 0);
}

TEST(StimulationControl, ASignalThatComesDuringTheSetUpStopsTheRunFromItsStart) {
  StimulationControl::expect_signals();
  ASSERT_EQ(std::raise(SIGUSR1), 0);
  StimulationSwitch stimulation;
  EXPECT_EQ(stimulation.stopped(), StimulationSwitch::By::kNone);
  {
    const StimulationControl control(stimulation);
    EXPECT_EQ(stimulation.stopped(), StimulationSwitch::By::kSignal);
  }
  stimulation.start();
  ASSERT_EQ(std::raise(SIGUSR1), 0);  // after the run: it ends nothing
  EXPECT_EQ(stimulation.stopped(), StimulationSwitch::By::kNone);
}

TEST(StimulationControl, TheTerminalStopsAndStarts) {
  const TemporaryFolder folder;
  const std::string scene = folder.file("scene.toml", kGrasp);
  const std::string csv = folder.path("c.csv");
  TerminalProgram program({"run", scene, "--duration-s", "60", "--sink", "stim-csv:" + csv}, 100);
  ASSERT_TRUE(wait_for_row(csv + ".part", ",80,"));
  program.type("halt\nstop\n");
  ASSERT_TRUE(program.wait_for("stimulation stopped by the terminal"));
  ASSERT_TRUE(wait_for_row(csv + ".part", ",stopped"));
  program.type("start\n");
  ASSERT_TRUE(program.wait_for("stimulation started again"));
  bool stopped = false;
  bool again = false;
  double before_uA = 0.0;
  for (int i = 0; i < 3000 && !again; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds{10});
    stopped = false;
    for (const auto& [amplitude_uA, stop] : amplitudes_and_stops(csv + ".part")) {
      if (stop == "stopped") stopped = true;
      // 1000 µA/s for an update and two ticks
      EXPECT_TRUE(!stopped || amplitude_uA <= before_uA + 12.0 + 1e-9) << amplitude_uA;
      before_uA = amplitude_uA;
      again = again || (stopped && amplitude_uA == 80.0);
    }
  }
  EXPECT_TRUE(again);
}

}  // namespace
}  // namespace merkel
