#include "tools/run/stop_signal.hpp"

#include <atomic>
#include <csignal>
#include <initializer_list>

namespace merkel {
namespace {

// A signal handler has no other access to the run.
std::atomic<Pipeline*> g_running{nullptr};
std::atomic<int> g_signals{0};
std::atomic<std::atomic<bool>*> g_flag{nullptr};

void handle_with(void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) ::sigaction(signal, &action, nullptr);
}

void stop_running(int /*signal*/) {
  if (std::atomic<bool>* const flag = g_flag.load()) flag->store(true);
  Pipeline* const pipeline = g_running.load();
  switch (g_signals.fetch_add(1)) {
    case 0:
      if (pipeline != nullptr) pipeline->request_stop();
      break;
    case 1:
      if (pipeline != nullptr) pipeline->request_stop_now();
      break;
    default:
      handle_with(SIG_DFL);  // the next signal ends the program
  }
}

}  // namespace

StopSignal::StopSignal() {
  g_signals.store(0);
  handle_with(stop_running);
}

StopSignal::StopSignal(Pipeline& pipeline) : StopSignal() { reach(pipeline); }

StopSignal::StopSignal(std::atomic<bool>& flag) {
  g_signals.store(0);
  g_flag.store(&flag);
  handle_with(stop_running);
}

void StopSignal::reach(Pipeline& pipeline) noexcept {
  g_running.store(&pipeline);
  if (requested()) pipeline.request_stop();
}

bool StopSignal::requested() const noexcept { return g_signals.load() > 0; }

StopSignal::~StopSignal() {
  handle_with(SIG_DFL);
  g_flag.store(nullptr);
  g_running.store(nullptr);
}

}  // namespace merkel
