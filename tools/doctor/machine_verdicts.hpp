#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "realtime/threads/thread_setup.hpp"
#include "tools/doctor/doctor_verdict.hpp"

namespace merkel {

/// The properties of this machine that affect its timing.
struct MachineFacts {
  struct SerialPort {
    std::string name;                     ///< "ttyUSB0"
    bool accessible = false;              ///< for reading and writing
    std::optional<int> latency_timer_ms;  ///< of an FTDI adapter
  };
  std::string kernel;            ///< release and version
  bool realtime_kernel = false;  ///< PREEMPT_RT
  bool hypervisor = false;       ///< a virtual machine
  std::string clock_source;
  std::string governor;                       ///< of core 0; empty if none
  std::optional<std::int64_t> rt_runtime_us;  ///< per second, for real-time threads; −1: unlimited
  std::string isolated_cores;
  std::vector<SerialPort> ports;
  RightsFacts rights;

  /// \param root  folder that holds /proc, /sys and /dev; "": this machine's
  [[nodiscard]] static MachineFacts read(const std::string& root = "");
};

/// Verdicts on these facts, each with its remedy.
[[nodiscard]] std::vector<Verdict> machine_verdicts(const MachineFacts& facts, int priority);

}  // namespace merkel
