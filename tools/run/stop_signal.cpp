#include "tools/run/stop_signal.hpp"

#include <atomic>
#include <csignal>

namespace merkel {
namespace {

// A signal handler has nothing else to reach the run by.
std::atomic<Pipeline*> g_running{nullptr};

void handle_with(void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
}

void stop_running(int /*signal*/) {
  handle_with(SIG_DFL);  // the next one ends the program
  if (Pipeline* const pipeline = g_running.load()) pipeline->request_stop();
}

}  // namespace

StopSignal::StopSignal(Pipeline& pipeline) {
  g_running.store(&pipeline);
  handle_with(stop_running);
}

StopSignal::~StopSignal() {
  handle_with(SIG_DFL);
  g_running.store(nullptr);
}

}  // namespace merkel
