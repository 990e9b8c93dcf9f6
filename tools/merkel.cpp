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

int main(int argc, char** argv) {
  open_standard_streams();
  // A closed pipe is an error of one sink, not the end of the program.
  std::signal(SIGPIPE, SIG_IGN);
  // The same holds for a file at the size limit.
  std::signal(SIGXFSZ, SIG_IGN);
  merkel::install_crash_report();
  const merkel::ReadFiles inputs;
  try {
    return merkel::run_command_line(argc, argv, [](merkel::CommandLine& program) {
      merkel::add_run_command(program);
      merkel::add_record_command(program);
      merkel::add_replay_command(program);
      merkel::add_export_command(program);
      merkel::add_compare_command(program);
      merkel::add_batch_command(program);
      merkel::add_merge_command(program);
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
      merkel::add_self_test_command(program);
      merkel::add_completion_command(program);
    });
  } catch (const std::system_error& error) {
    if (error.code() != std::errc::resource_unavailable_try_again)
      return merkel::fail(error.what());
    merkel::warn(
        "the system refuses another thread: every probe and every sink needs one; use fewer of them, "
        "or raise the limits of processes and memory (ulimit -u, ulimit -v, TasksMax of a service)");
    return merkel::kRefused;
  } catch (const std::bad_alloc&) {
    merkel::warn(
        "out of memory: use a smaller input or a smaller scene, or raise the limit of memory "
        "(ulimit -v, MemoryMax of a service)");
    return merkel::kRefused;
  } catch (const std::exception& error) {
    return merkel::fail(error.what());
  }
}
