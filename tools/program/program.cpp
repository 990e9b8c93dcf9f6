#include "tools/program/program.hpp"

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <exception>
#include <new>
#include <system_error>

#include <fcntl.h>
#include <unistd.h>

#include "drivers/files/input_file.hpp"
#include "tools/command_line.hpp"
#include "tools/commands/command.hpp"
#include "tools/run/crash_report.hpp"
#include "tools/run/stimulation_control.hpp"

namespace merkel {
namespace {

/// Fills closed standard streams with placeholders; otherwise a file or a device that is opened
/// later would get one of their descriptors and receive the messages to the user. Writing to a
/// placeholder fails.
void open_standard_streams() {
  for (int descriptor = 0; descriptor <= STDERR_FILENO; ++descriptor) {
    if (::fcntl(descriptor, F_GETFD) != -1 || errno != EBADF) continue;
    if (::open("/dev/null", descriptor == STDIN_FILENO ? O_WRONLY : O_RDONLY) != descriptor) {
      std::_Exit(1);
    }
  }
}

}  // namespace

int run_merkel(int argc, char** argv) {
  open_standard_streams();
  // A closed pipe is an error of one sink, not the end of the program.
  std::signal(SIGPIPE, SIG_IGN);
  // The same holds for a file at the size limit.
  std::signal(SIGXFSZ, SIG_IGN);
  StimulationControl::expect_signals();
  install_crash_report();
  const ReadFiles inputs;
  try {
    return run_command_line(argc, argv, [](CommandLine& program) {
      for (AddCommand* const add : {add_run_command,       add_record_command,
                                    add_replay_command,    add_export_command,
                                    add_compare_command,   add_compare_encoders_command,
                                    add_batch_command,     add_merge_command,
                                    add_align_command,     add_bundle_command,
                                    add_plot_command,      add_doctor_command,
                                    add_probes_command,    add_connect_command,
                                    add_calibrate_command, add_simulate_probe_command,
                                    add_inspect_command,   add_scene_command,
                                    add_figures_command,   add_score_command,
                                    add_fit_command,       add_bench_command,
                                    add_chart_command,     add_plan_command,
                                    add_self_test_command, add_completion_command})
        add(program);
    });
  } catch (const std::system_error& error) {
    if (error.code() != std::errc::resource_unavailable_try_again) return fail(error.what());
    warn(
        "the system refuses another thread: every probe and every sink needs one; use fewer of them, "
        "or raise the limits of processes and memory (ulimit -u, ulimit -v, TasksMax of a service)");
    return kRefused;
  } catch (const std::bad_alloc&) {
    warn(
        "out of memory: use a smaller input or a smaller scene, or raise the limit of memory "
        "(ulimit -v, MemoryMax of a service)");
    return kRefused;
  } catch (const std::exception& error) {
    return fail(error.what());
  }
}

}  // namespace merkel
