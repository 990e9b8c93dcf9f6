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

/// The faults of a simulated device. Probabilities are per byte or frame; times are seconds after
/// the start of the press.
struct SimulatedFaults {
  double drop_byte = 0.0;             ///< probability of losing a byte
  double flip_byte = 0.0;             ///< probability of a flipped bit in a byte
  double drop_frame = 0.0;            ///< probability of losing a whole frame
  bool split = false;                 ///< frames are split
  std::chrono::nanoseconds batch{0};  ///< interval at which held-back bytes are sent
  std::optional<std::chrono::nanoseconds> stall_at;
  std::chrono::nanoseconds stall_for{std::chrono::milliseconds{500}};
  std::optional<std::chrono::nanoseconds> unplug_at;
  std::chrono::nanoseconds unplug_for{std::chrono::milliseconds{500}};
  std::optional<std::chrono::nanoseconds> reboot_at;
  bool echo = false;       ///< the host's bytes are sent back
  double drift_ppm = 0.0;  ///< of the device's clock; positive is fast
  std::uint64_t seed = 1;
};

/// Plays a trace like a device of a protocol, on a pseudo-terminal or over the network.
class DeviceSimulator {
 public:
  struct Settings {
    const ProtocolEntry* protocol = nullptr;
    std::vector<ProbeSample> trace;               ///< in order of time; at least one
    std::vector<std::string> extra_columns = {};  ///< names of further columns
    std::vector<std::string> taxels = {};         ///< names of a tactile array's channels
    /// A row for each sample: the further columns, then the pressures of the taxels in kPa. Those
    /// that are missing are 0.
    std::vector<double> others = {};
    int baud = 115200;  ///< a host with another rate reads garbage
    std::string link;   ///< symbolic link to the terminal; empty: none
    /// Network address instead of a terminal: "udp:HOST:PORT" or "tcp:HOST:PORT".
    std::string network;
    bool repeat = false;                  ///< start again at the end of the trace
    std::optional<std::uint32_t> pulses;  ///< seed of pulses on its sync line
    std::optional<double> rate_Hz;        ///< measurements per second; default: the trace's
    SimulatedFaults faults;
  };
  /// The device's counters.
  struct Counts {
    std::uint64_t measured = 0;        ///< samples of the trace
    std::uint64_t unsent = 0;          ///< not sent: unplugged, restarting or not requested
    std::uint64_t frames_dropped = 0;  ///< by the fault
    std::uint64_t bytes_sent = 0;
    std::uint64_t bytes_dropped = 0;
    std::uint64_t bytes_flipped = 0;
    std::uint64_t bytes_overrun = 0;  ///< not read by the host in time
    std::uint64_t reboots = 0;
    std::uint64_t unplugs = 0;
  };

  [[nodiscard]] static Expected<std::unique_ptr<DeviceSimulator>, SetupError> create(
      Settings settings);

  /// The probe URI to read it from.
  [[nodiscard]] std::string uri() const;
  /// Plays until `stop`. The press starts when a host listens.
  void run(const std::atomic<bool>& stop);
  /// Valid after run().
  [[nodiscard]] const Counts& counts() const noexcept { return counts_; }

 private:
  using Time = std::chrono::nanoseconds;
  explicit DeviceSimulator(Settings settings);

  void step(Time now);
  void play(Time now);
  [[nodiscard]] Time next_sample() const noexcept;
  [[nodiscard]] std::optional<Time> period() const noexcept;
  [[nodiscard]] std::span<const double> others_of(std::size_t sample) const noexcept;
  ProbeSample interpolate(Time trace_time);
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
  std::optional<Time> started_;  ///< host time of the start of the press
  Time trace_start_{0};          ///< device time of that start, since the device's last restart
  std::size_t next_ = 0;         ///< next sample of the trace
  Time mean_period_{1'000'000};  ///< of the trace; an assumption for a single sample
  Time next_time_{0};            ///< with a set rate: time of the next sample since the start
  Time round_{0};                ///< trace time of earlier rounds
  bool plugged_ = true;
  bool stalled_ = false;
  Time unplugged_until_{0};
  Time stalled_until_{0};
  Time next_batch_{0};
  Bytes held_;
  std::vector<double> others_;  ///< of interpolate()
};

}  // namespace merkel
