#include "tests/tools/program.hpp"

#include <csignal>

#include <fcntl.h>
#include <spawn.h>
#include <sys/resource.h>
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

ProgramRun StartedProgram::finish() {
  ProgramRun run;
  if (process_ == 0) return run;
  int status = 0;
  rusage usage{};
  ::wait4(process_, &status, 0, &usage);
  run.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  run.ended_by = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  run.out = read_file(folder_.path("out"));
  run.err = read_file(folder_.path("err"));
  run.peak_memory_MiB = static_cast<double>(usage.ru_maxrss) / 1024.0;
  return run;
}

ProgramRun run_program(const std::vector<std::string>& arguments) {
  return StartedProgram(arguments).finish();
}

}  // namespace merkel
