#include <csignal>
#include <exception>

#include "tools/command_line.hpp"
#include "tools/commands/command.hpp"
#include "tools/run/crash_report.hpp"

int main(int argc, char** argv) {
  // A reader that goes away is an error of one sink, not the end of the program.
  std::signal(SIGPIPE, SIG_IGN);
  // So is a file that has reached the user's limit.
  std::signal(SIGXFSZ, SIG_IGN);
  merkel::install_crash_report();
  try {
    return merkel::run_command_line(argc, argv, [](merkel::CommandLine& program) {
      merkel::add_run_command(program);
      merkel::add_record_command(program);
      merkel::add_replay_command(program);
      merkel::add_export_command(program);
      merkel::add_doctor_command(program);
      merkel::add_probes_command(program);
      merkel::add_connect_command(program);
      merkel::add_calibrate_command(program);
      merkel::add_simulate_probe_command(program);
      merkel::add_inspect_command(program);
      merkel::add_scene_command(program);
      merkel::add_figures_command(program);
      merkel::add_score_command(program);
      merkel::add_fit_command(program);
      merkel::add_bench_command(program);
      merkel::add_chart_command(program);
      merkel::add_plan_command(program);
    });
  } catch (const std::exception& error) {
    return merkel::fail(error.what());
  }
}
