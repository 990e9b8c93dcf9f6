#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "core/math/random.hpp"
#include "core/records/probe_sample.hpp"
#include "drivers/protocols/protocol_table.hpp"
#include "drivers/simulation/device_line.hpp"

namespace merkel {

/// How a simulated device misbehaves. Probabilities are per byte or frame; times are seconds after
/// the press has started.
struct SimulatedFaults {
  double drop_byte = 0.0;             ///< probability that a byte gets lost
  double flip_byte = 0.0;             ///< probability that a bit of a byte is turned over
  double drop_frame = 0.0;            ///< probability that a whole frame gets lost
  bool split = false;                 ///< frames come in pieces
  std::chrono::nanoseconds batch{0};  ///< bytes are held back and come together, so often
  std::optional<std::chrono::nanoseconds> stall_at;
  std::chrono::nanoseconds stall_for{std::chrono::milliseconds{500}};
  std::optional<std::chrono::nanoseconds> unplug_at;
  std::chrono::nanoseconds unplug_for{std::chrono::milliseconds{500}};
  std::optional<std::chrono::nanoseconds> reboot_at;
  bool echo = false;       ///< what the host sends comes back
  double drift_ppm = 0.0;  ///< of the device's clock; positive is fast
  std::uint64_t seed = 1;
};

/// Plays a trace as a device of a protocol would, on a pseudo-terminal or over the network.
class DeviceSimulator {
 public:
  struct Settings {
    const ProtocolEntry* protocol = nullptr;
    std::vector<ProbeSample> trace;  ///< in order of time; at least one
    int baud = 115200;               ///< a host that has set another reads garbage
    std::string link;                ///< symbolic link to the terminal; none, if empty
    /// A line over the network instead of a terminal: "udp:HOST:PORT" or "tcp:HOST:PORT".
    std::string network;
    bool repeat = false;            ///< begin again at the end of the trace
    std::optional<double> rate_Hz;  ///< measurements a second; those of the trace, if not set
    SimulatedFaults faults;
  };
  /// What it did.
  struct Counts {
    std::uint64_t measured = 0;        ///< samples of the trace
    std::uint64_t unsent = 0;          ///< of those: while unplugged, restarting or not asked for
    std::uint64_t frames_dropped = 0;  ///< on purpose
    std::uint64_t bytes_sent = 0;
    std::uint64_t bytes_dropped = 0;
    std::uint64_t bytes_flipped = 0;
    std::uint64_t bytes_overrun = 0;  ///< the host did not read them in time
    std::uint64_t reboots = 0;
    std::uint64_t unplugs = 0;
  };

  [[nodiscard]] static Expected<std::unique_ptr<DeviceSimulator>, SetupError> create(
      Settings settings);

  /// The probe URI under which it can be read.
  [[nodiscard]] std::string uri() const;
  /// Plays until told to stop. The press begins when the host has started to listen.
  void run(const std::atomic<bool>& stop);
  /// Read after run().
  [[nodiscard]] const Counts& counts() const noexcept { return counts_; }

 private:
  using Time = std::chrono::nanoseconds;
  explicit DeviceSimulator(Settings settings);

  void step(Time now);
  void play(Time now);
  [[nodiscard]] Time next_sample() const noexcept;
  [[nodiscard]] std::optional<Time> period() const noexcept;
  [[nodiscard]] ProbeSample sample_at(Time trace_time) const noexcept;
  void boot(Time now);
  void pass_faults(Time now);
  void listen(Time patience);
  void send(const Bytes& bytes, bool whole_frame);
  void flush(Time now);
  [[nodiscard]] Time device_time(Time now) const noexcept;
  [[nodiscard]] Time next_event(Time now) const noexcept;

  Settings settings_;
  Random random_;
  std::unique_ptr<DeviceLine> line_;
  std::unique_ptr<SimulatedDevice> device_;
  Counts counts_;

  Time booted_{0};
  std::optional<Time> begun_;    ///< host time at which the press began
  Time trace_start_{0};          ///< device time at which it began, of this run of the device
  std::size_t next_ = 0;         ///< sample of the trace that comes next
  Time mean_period_{1'000'000};  ///< of the trace
  Time next_time_{0};  ///< or where the rate is set: the time of the next, since the beginning
  Time round_{0};      ///< trace time that earlier rounds took
  bool plugged_ = true;
  bool stalled_ = false;
  Time unplugged_until_{0};
  Time stalled_until_{0};
  Time next_batch_{0};
  Bytes held_;
};

}  // namespace merkel
