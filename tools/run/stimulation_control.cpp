#include "tools/run/stimulation_control.hpp"

#include <array>
#include <atomic>
#include <csignal>
#include <string>
#include <string_view>

#include <poll.h>
#include <unistd.h>

namespace merkel {
namespace {

using By = StimulationSwitch::By;

constexpr int kLookEvery_ms = 100;
constexpr std::size_t kMaxOrder = 64;

// A signal handler has no other access to the run.
std::atomic<StimulationSwitch*> g_switch{nullptr};
std::atomic<bool> g_stop_waits{false};

void stop_by_signal(int /*signal*/) {
  g_stop_waits.store(true);
  if (StimulationSwitch* const stimulation = g_switch.load()) stimulation->stop(By::kSignal);
}

/// A background process that reads its controlling terminal would be suspended.
bool may_read_terminal() {
  if (::isatty(STDIN_FILENO) == 0) return false;
  const pid_t foreground = ::tcgetpgrp(STDIN_FILENO);
  return foreground < 0 || foreground == ::getpgrp();
}

void obey_lines(const std::stop_token& stop, StimulationSwitch& stimulation) {
  std::string line;
  while (!stop.stop_requested()) {
    pollfd input{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
    if (::poll(&input, 1, kLookEvery_ms) <= 0) continue;
    std::array<char, kMaxOrder> bytes{};
    const ssize_t count =
        may_read_terminal() ? ::read(STDIN_FILENO, bytes.data(), bytes.size()) : 0;
    if (count <= 0) {
      // In the background, or the terminal is gone.
      if ((input.revents & (POLLHUP | POLLERR)) != 0) return;
      std::this_thread::sleep_for(std::chrono::milliseconds{kLookEvery_ms});
      continue;
    }
    for (const char c : std::string_view(bytes.data(), static_cast<std::size_t>(count))) {
      if (c != '\n') {
        if (line.size() < kMaxOrder && c != ' ' && c != '\r') line += c;
        continue;
      }
      if (line == "stop") stimulation.stop(By::kTerminal);
      if (line == "start") stimulation.start();
      line.clear();
    }
  }
}

}  // namespace

void StimulationControl::expect_signals() noexcept {
  struct sigaction action {};
  action.sa_handler = stop_by_signal;
  action.sa_flags = SA_RESTART;
  ::sigaction(SIGUSR1, &action, nullptr);
}

StimulationControl::StimulationControl(StimulationSwitch& stimulation) {
  g_switch.store(&stimulation);
  if (g_stop_waits.load()) stimulation.stop(By::kSignal);
  if (::isatty(STDIN_FILENO) == 0) return;
  reader_ =
      std::jthread([&stimulation](const std::stop_token& stop) { obey_lines(stop, stimulation); });
}

StimulationControl::~StimulationControl() { g_switch.store(nullptr); }

}  // namespace merkel
