#pragma once

#include <thread>

#include "realtime/pipeline.hpp"

namespace merkel {

/// While it exists, SIGUSR1 and the line `stop` on the terminal stop the stimulation of a run; the
/// line `start` starts it again. One object at a time.
class StimulationControl {
 public:
  /// From now on SIGUSR1 does not end the program: a signal that comes before there is an object is
  /// kept for the next one.
  static void expect_signals() noexcept;

  /// Reads lines only if standard input is the terminal of this process. \param stimulation
  /// borrowed
  explicit StimulationControl(StimulationSwitch& stimulation);
  StimulationControl(const StimulationControl&) = delete;
  StimulationControl& operator=(const StimulationControl&) = delete;
  ~StimulationControl();

 private:
  std::jthread reader_;
};

}  // namespace merkel
