#pragma once

#include <functional>
#include <list>

#include <pybind11/pybind11.h>

namespace merkel::python {

/// The end of the interpreter while threads are in this module. Python ends a daemon thread that
/// asks for the GIL then by unwinding its stack, which C++ answers with std::terminate(). So all
/// runs are ended first, by a function that atexit calls, and from then on a thread that asks for
/// the GIL waits in GilRelease or GilAcquire until the process ends.

/// Registers that function with atexit.
void end_runs_at_exit();

/// A run that the end of the interpreter ends.
class LiveRun {
 public:
  /// \param end  ends the run and waits until it is over. Called without the GIL. Thread: any.
  explicit LiveRun(std::function<void()> end);
  LiveRun(const LiveRun&) = delete;
  LiveRun& operator=(const LiveRun&) = delete;
  ~LiveRun();

 private:
  std::list<std::function<void()>>::iterator place_;
};

/// Before a thread asks for the GIL. Does not return after the runs were ended, except in the
/// thread that ends the interpreter.
void before_gil() noexcept;
/// After it has the GIL.
void after_gil() noexcept;
/// Waits until the process ends.
[[noreturn]] void wait_for_exit() noexcept;

/// Before an error that a run's end causes. Does not return while the interpreter ends the runs,
/// except in the thread that does: a daemon thread would write its traceback while the interpreter
/// takes standard error from it, which ends the process. With or without the GIL.
void wait_if_exiting();

/// Gives the GIL back for its lifetime.
class GilRelease {
 public:
  GilRelease() : state_(PyEval_SaveThread()) {}
  GilRelease(const GilRelease&) = delete;
  GilRelease& operator=(const GilRelease&) = delete;
  ~GilRelease() {
    before_gil();
    PyEval_RestoreThread(state_);
    after_gil();
  }

 private:
  PyThreadState* state_;
};

/// Has the GIL for its lifetime.
class GilAcquire {
 private:
  struct Before {
    Before() noexcept { before_gil(); }
  };
  struct After {
    After() noexcept { after_gil(); }
  };
  Before before_;
  pybind11::gil_scoped_acquire gil_;
  After after_;
};

}  // namespace merkel::python
