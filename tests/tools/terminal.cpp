#include "tests/tools/terminal.hpp"

#include <chrono>
#include <csignal>

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace merkel {

TerminalProgram::TerminalProgram(const std::vector<std::string>& arguments,
                                 unsigned short columns) {
  master_ = ::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
  EXPECT_EQ(::grantpt(master_), 0);
  EXPECT_EQ(::unlockpt(master_), 0);
  winsize size{};
  size.ws_row = 24;
  size.ws_col = columns;
  EXPECT_EQ(::ioctl(master_, TIOCSWINSZ, &size), 0);
  const std::string slave = ::ptsname(master_);

  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, slave.c_str(), O_RDWR | O_NOCTTY, 0);
  ::posix_spawn_file_actions_adddup2(&actions, STDIN_FILENO, STDERR_FILENO);
  ::posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, folder_.path("out").c_str(),
                                     O_WRONLY | O_CREAT, 0600);
  process_ = spawn_program(arguments, actions);
  ::posix_spawn_file_actions_destroy(&actions);
  reader_ = std::jthread([this](const std::stop_token& stop) {
    std::vector<char> bytes(4096);
    while (!stop.stop_requested()) {
      pollfd watched{.fd = master_, .events = POLLIN, .revents = 0};
      if (::poll(&watched, 1, 20) <= 0) continue;
      const auto count = ::read(master_, bytes.data(), bytes.size());
      if (count <= 0) return;  // the program has closed its end
      const std::scoped_lock lock(mutex_);
      shown_.append(bytes.data(), static_cast<std::size_t>(count));
    }
  });
}

TerminalProgram::~TerminalProgram() {
  if (process_ != 0) {
    ::kill(process_, SIGKILL);
    finish();
  }
  ::close(master_);
}

std::string TerminalProgram::shown() {
  const std::scoped_lock lock(mutex_);
  return shown_;
}

bool TerminalProgram::wait_for(const std::string& text) {
  for (int i = 0; i < 1000; ++i) {
    if (shown().find(text) != std::string::npos) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds{10});
  }
  return false;
}

void TerminalProgram::type(const std::string& text) const {
  EXPECT_EQ(::write(master_, text.data(), text.size()), static_cast<ssize_t>(text.size()));
}

ProgramRun TerminalProgram::finish() {
  ProgramRun run;
  int status = 0;
  ::waitpid(process_, &status, 0);
  process_ = 0;
  run.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  run.ended_by = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  std::this_thread::sleep_for(std::chrono::milliseconds{30});
  reader_.request_stop();
  reader_.join();
  run.out = read_file(folder_.path("out"));
  run.err = shown_;
  return run;
}

}  // namespace merkel
