#include "tests/tools/program.hpp"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <thread>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

namespace merkel {

int spawn_program(const std::vector<std::string>& arguments,
                  const posix_spawn_file_actions_t& actions) {
  std::vector<std::string> words = {MERKEL_PROGRAM};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  pid_t child = 0;
  return ::posix_spawn(&child, argv[0], &actions, nullptr, argv.data(), environ) == 0 ? child : 0;
}

StartedProgram::StartedProgram(const std::vector<std::string>& arguments) {
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  const int flags = O_WRONLY | O_CREAT;
  ::posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  ::posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, folder_.path("out").c_str(), flags,
                                     0600);
  ::posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, folder_.path("err").c_str(), flags,
                                     0600);
  process_ = spawn_program(arguments, actions);
  ::posix_spawn_file_actions_destroy(&actions);
}

void StartedProgram::send(int signal) const {
  if (process_ != 0) ::kill(process_, signal);  // 0 would be this program and its parents
}

namespace {

/// The largest resident memory of a running process so far; 0 if it has ended. Unlike wait4(), it
/// does not count what the starting process had resident.
double peak_memory_MiB_of(int process) {
  std::ifstream status("/proc/" + std::to_string(process) + "/status");
  for (std::string word; status >> word;) {
    double kibibytes = 0.0;
    if (word == "VmHWM:" && status >> kibibytes) return kibibytes / 1024.0;
  }
  return 0.0;
}

}  // namespace

ProgramRun StartedProgram::finish() {
  ProgramRun run;
  if (process_ == 0) return run;
  int status = 0;
  while (::waitpid(process_, &status, WNOHANG) == 0) {
    run.peak_memory_MiB = std::max(run.peak_memory_MiB, peak_memory_MiB_of(process_));
    std::this_thread::sleep_for(std::chrono::milliseconds{1});
  }
  run.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  run.ended_by = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  run.out = read_file(folder_.path("out"));
  run.err = read_file(folder_.path("err"));
  return run;
}

ProgramRun run_program(const std::vector<std::string>& arguments) {
  return StartedProgram(arguments).finish();
}

}  // namespace merkel
