#include "tools/python/src/interpreter_exit.hpp"

#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>
#include <utility>

#include <pthread.h>
#include <unistd.h>

#include "core/contact/tip_field.hpp"

namespace merkel::python {
namespace {

std::mutex runs_mutex;  ///< guards the next two
std::list<std::function<void()>> runs;
bool runs_ended = false;

std::atomic<int> asking{0};       ///< threads that ask for the GIL
std::atomic<bool> ending{false};  ///< the runs
std::atomic<bool> exiting{false};
pthread_t exiting_thread;  ///< written before the two

void end_runs() {
  exiting_thread = ::pthread_self();
  ending.store(true);
  const pybind11::gil_scoped_release no_gil;
  {
    const std::scoped_lock lock(runs_mutex);
    for (const auto& end : runs) end();
    runs_ended = true;
  }
  exiting.store(true);
  while (asking.load() > 0) std::this_thread::sleep_for(std::chrono::milliseconds{1});
}

}  // namespace

void end_runs_at_exit() {
  pybind11::module_::import("atexit").attr("register")(pybind11::cpp_function(&end_runs));
  // A fork has one thread, which has the GIL.
  ::pthread_atfork(nullptr, nullptr, [] {
    asking.store(0);
    TipField::shared_after_fork();
  });
}

LiveRun::LiveRun(std::function<void()> end) {
  const std::scoped_lock lock(runs_mutex);
  place_ = runs.insert(runs.end(), std::move(end));
  if (runs_ended && ::pthread_equal(exiting_thread, ::pthread_self()) == 0) (*place_)();
}

LiveRun::~LiveRun() {
  const std::scoped_lock lock(runs_mutex);
  runs.erase(place_);
}

void before_gil() noexcept {
  asking.fetch_add(1);
  if (!exiting.load() || ::pthread_equal(exiting_thread, ::pthread_self()) != 0) return;
  asking.fetch_sub(1);
  wait_for_exit();
}

void after_gil() noexcept { asking.fetch_sub(1); }

void wait_if_exiting() {
  if (!ending.load() || ::pthread_equal(exiting_thread, ::pthread_self()) != 0) return;
  if (PyGILState_Check() != 0) PyEval_SaveThread();
  wait_for_exit();
}

void wait_for_exit() noexcept {
  while (true) ::pause();
}

}  // namespace merkel::python
