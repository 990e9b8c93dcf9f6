#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "drivers/probe.hpp"
#include "drivers/probes/channel_selection.hpp"
#include "drivers/probes/device_notices.hpp"
#include "drivers/probes/device_output.hpp"
#include "drivers/probes/host_clock.hpp"
#include "drivers/probes/port_log.hpp"
#include "drivers/probes/reading_times.hpp"
#include "drivers/probes/stream_quality.hpp"
#include "drivers/probes/sync_lines.hpp"
#include "drivers/protocols/protocol.hpp"
#include "drivers/transports/transport.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// A device: a protocol on a transport, its clock mapped to the host's, its readings calibrated.
/// Reconnects automatically after it was unplugged; one that is not live has ended then.
class DeviceProbe final : public Probe {
 public:
  struct Settings {
    std::string uri;                      ///< without what follows '#',
    std::vector<ChannelSelection> parts;  ///< which is this, one for each probe that it feeds
    std::string protocol;                 ///< its name, for messages
    ReadingTimes::Rule times = ReadingTimes::Rule::kMapped;
    std::string calibration;                ///< file; empty: none
    std::vector<std::string> calibrations;  ///< of each probe that it feeds, instead
    std::string sync;                       ///< its sync lines: SyncLines::choose()
    std::chrono::milliseconds silence{2000};
    StreamQuality::Parameters quality;
    std::chrono::milliseconds boot{0};  ///< further patience for the first byte
    /// False: it is read like a recording, as fast as it sends, and on its own times.
    bool live = true;
    std::string hint;  ///< what to check if no valid data arrives ("the baud rate, …")
    HostClock* clock = &HostClock::real();
  };
  /// Reads the options common to all devices: clock, calibration, timeout_ms, bad_share,
  /// bad_window_ms; live of those that wait until they are read.
  [[nodiscard]] static Settings settings_from(UriOptions& options, const Uri& uri,
                                              const DeviceUri& device);

  /// Listens until the device has reported what it measures. Fails if it sends nothing, invalid
  /// data, or data of another protocol; the error identifies the case.
  [[nodiscard]] static Expected<std::unique_ptr<Probe>, SetupError> open(
      std::unique_ptr<Transport> transport, std::unique_ptr<Protocol> protocol, Settings settings);
  ~DeviceProbe() override;

  [[nodiscard]] std::span<const ProbeInfo> outputs() const noexcept override { return infos_; }
  using Probe::read;
  [[nodiscard]] Expected<std::size_t, ProbeError> read(Readings& readings,
                                                       std::chrono::milliseconds patience) override;
  [[nodiscard]] ProbeStatus status() const override;
  [[nodiscard]] std::vector<std::string> take_notices() override;
  [[nodiscard]] bool request_tare(std::size_t output) noexcept override {
    outputs_[output].request_tare();
    return true;
  }
  [[nodiscard]] std::size_t ports() const noexcept override { return 1; }
  void add_listener(std::size_t /*port*/, PortListener& listener) override { log_.add(listener); }
  void remove_listener(std::size_t /*port*/, PortListener& listener) override {
    log_.remove(listener);
  }

 private:
  using Time = std::chrono::nanoseconds;

  DeviceProbe(std::unique_ptr<Transport> transport, std::unique_ptr<Protocol> protocol,
              Settings settings);
  [[nodiscard]] Time now() const { return settings_.clock->now(); }
  Expected<void, SetupError> listen();
  Expected<void, SetupError> make_outputs();

  /// Sends and receives once; waits until `until` at most. False if disconnected.
  bool exchange(Time until);
  bool send();
  void disconnected(Time now);
  bool connect_again(Time until);
  void end_outage(Time now);
  void start();
  void discard_old_input();
  void follow_restarts(Time now);
  void take_readings();
  void deliver(const DeviceReading& reading, Time time);
  void clear_ready();
  [[nodiscard]] bool same_device();
  void judge_quality();
  [[nodiscard]] std::string expected() const;
  [[nodiscard]] std::string to_check() const;
  void notice(const std::string& sentence);
  void publish();

  Settings settings_;
  std::unique_ptr<Transport> transport_;
  std::unique_ptr<Protocol> protocol_;
  std::string name_;                  ///< of the device, for messages
  std::deque<DeviceOutput> outputs_;  ///< at least one
  std::vector<ProbeInfo> infos_;      ///< of each
  ReadingTimes times_;
  SyncLines sync_lines_;
  std::vector<SyncEdge> edges_;    ///< not delivered yet
  std::vector<TaxelZeros> zeros_;  ///< the same
  DeviceStream stream_;
  StreamQuality quality_;
  ProtocolCounts judged_;  ///< the counts up to which quality_ has judged
  PortLog log_;
  Bytes heard_;  ///< the first bytes, to recognise another protocol
  std::vector<std::uint8_t> buffer_;
  std::uint64_t rejected_datagrams_ = 0;  ///< of the port, as last seen
  std::optional<Readings> ready_;         ///< set with outputs_
  std::size_t next_ready_ = 0;            ///< those before it are delivered

  std::string opened_serial_number_;
  bool other_device_reported_ = false;
  bool overran_ = false;  ///< the readings lost by that are not counted yet
  bool started_ = false;
  std::atomic<bool> connected_{true};
  bool away_ = false;  ///< it was disconnected, and has sent nothing since
  Time lost_since_{0};
  Time try_again_{0};
  Time backoff_{0};
  Time last_exchange_{0};
  Time held_up_until_{0};  ///< what was measured before has waited for this host
  Time last_time_{0};
  std::uint32_t sequence_ = 0;
  Time first_reading_{0};
  Time last_sense_{0};  ///< time of the last complete frame
  std::uint64_t frames_at_last_sense_ = 0;
  std::uint64_t bytes_at_last_sense_ = 0;
  bool silence_reported_ = false;

  DeviceCounts counts_;               ///< of the probe thread, as are
  std::vector<OutputFaults> faults_;  ///< of each output
  DeviceNotices notices_;
  mutable std::mutex mutex_;
  DeviceCounts published_;                      ///< guarded by mutex_, as are
  std::vector<OutputFaults> published_faults_;  ///< of each output
};

}  // namespace merkel
