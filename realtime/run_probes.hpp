#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/expected.hpp"
#include "core/records/run_counters.hpp"
#include "drivers/probe.hpp"
#include "realtime/input/probe_input.hpp"
#include "realtime/input/probe_queue.hpp"
#include "realtime/input/probe_reader.hpp"
#include "realtime/output/run_watch.hpp"
#include "realtime/run_report.hpp"

namespace merkel {

/// The probes of a run, and the devices that feed them, each with its thread and its ring of
/// readings to the loop. Thread: that of Pipeline::run(), unless stated otherwise.
class RunProbes {
 public:
  /// Makes the feeds of a probe, by its number, each with room for `capacity` samples.
  using MakeFeeds = std::function<std::vector<Feed<DeliveredSample>*>(
      std::size_t capacity, std::uint32_t probe, const ProbeColumns& columns)>;

  /// The memory of a probe's part of the ring of its device, in bytes.
  [[nodiscard]] static std::size_t queue_bytes(const ProbeInfo& probe);

  /// Adds a device. \param inputs  one for each of its outputs
  void add(std::unique_ptr<Probe> device, const std::vector<RunInput>& inputs);

  [[nodiscard]] std::size_t size() const noexcept { return routes_.size(); }
  /// Whether each number up to size() has a probe.
  [[nodiscard]] bool complete() const noexcept;
  /// The device of a probe. Thread: any, after the start.
  /// What a probe is, as its device describes it.
  [[nodiscard]] const ProbeInfo& info(std::size_t probe) const noexcept;
  [[nodiscard]] Probe& device_of(std::size_t probe) const {
    return *routes_.at(probe)->device->probe;
  }
  /// The time of the newest sample of all probes. Thread: any, after the start.
  [[nodiscard]] std::chrono::nanoseconds newest() const noexcept;
  /// The output of its device that feeds a probe.
  [[nodiscard]] std::size_t output_of(std::size_t probe) const { return routes_.at(probe)->output; }
  /// Whether a probe is the first one that its device feeds.
  [[nodiscard]] bool is_first_of_device(std::size_t probe) const {
    return routes_.at(probe).get() == routes_.at(probe)->device->routes.front();
  }
  /// The feeds of the device of a probe; complete before start().
  [[nodiscard]] ProbeReader::DeviceFeeds& feeds_of(std::size_t probe) {
    return routes_.at(probe)->device->feeds;
  }
  /// One per probe, for the loop; made by start().
  [[nodiscard]] std::span<ProbeInput> inputs() noexcept { return inputs_; }
  [[nodiscard]] bool all_replayed() const;

  /// Starts the threads.
  /// \param realtime  see ProbeReader::Parameters; none: on a virtual clock, so sinks are awaited
  void start(const MakeFeeds& make_feeds, const std::optional<RealtimeSettings>& realtime);
  /// Waits until every probe has sent a sample, or `stop` is set. Fails if one stays silent or its
  /// stream ends without one.
  [[nodiscard]] Expected<void, SetupError> wait_for_first_samples(const std::atomic<bool>& stop);
  /// Waits until the timing of the devices' samples is measured, or `stop` is set. Meanwhile their
  /// samples wait in the queues; none is lost.
  void wait_for_timing(const std::atomic<bool>& stop) const;

  /// The earliest and the latest of the probes' first times, once all have sent a sample. A session
  /// begins with the first tick of the run that recorded it, so that it plays on the same ticks.
  [[nodiscard]] std::pair<std::chrono::nanoseconds, std::chrono::nanoseconds> first_times() const;
  /// The run that recorded the first session among recordings; none if there is a device.
  [[nodiscard]] std::optional<RecordedRun> recorded_run() const;

  /// How long the loop must wait for the samples of the slowest device, at most its ceiling; 0 for
  /// recordings.
  [[nodiscard]] std::chrono::nanoseconds measured_delay() const;
  /// Fails if a ceiling of the delay does not leave time for the next sample.
  [[nodiscard]] Expected<void, SetupError> check_ceilings() const;
  /// Fails if a device is so slow that the watchdog of the electrodes would take every pause
  /// between its samples for a fault.
  [[nodiscard]] Expected<void, SetupError> check_watchdog(std::chrono::nanoseconds watchdog) const;
  /// The start of a run, at most a tick earlier, so that each tick ends shortly after a sample of
  /// the first device: that sample waits for no tick, and jitter does not move it to the next one.
  [[nodiscard]] std::chrono::nanoseconds aligned(std::chrono::nanoseconds start,
                                                 std::chrono::nanoseconds tick) const;
  /// From now on, the loop measures the delay of each device.
  void measure_delays();
  /// The ticks for which their samples are awaited; after measure_delays().
  void set_ticks(std::chrono::nanoseconds start, std::chrono::nanoseconds tick) noexcept;
  /// Adds the devices to the watch of the run. \param patches  one per probe
  void add_devices_to(RunWatch& watch, std::span<const std::size_t> patches) const;
  /// The current press of each probe. Thread: any.
  [[nodiscard]] std::vector<RunProgress::ProbeProgress> readings() const;
  /// Adds the counts of all probes. Thread: any.
  void add_to(RunCounters& counters) const;
  /// Passes on the notices of the drivers.
  void take_notices(const std::function<void(const std::string&)>& on_notice);
  /// Stops the threads: nothing is put into the queues and feeds any more.
  void stop();
  /// Stops the threads and reports each probe.
  void finish(RunReport& report);

 private:
  struct Device;
  /// The way of the samples from one output of a device to the loop.
  struct Route {
    Route(Device& the_device, std::size_t the_output, const ProbeInput::Parameters& the_parameters,
          const std::shared_ptr<ReadingRing>& ring);
    [[nodiscard]] const ProbeInfo& info() const noexcept;

    Device* device;
    std::size_t output;
    ProbeInput::Parameters parameters;
    ProbeQueue channel;
    ContactDecision contact;  ///< of the device's thread until it has stopped
  };
  struct Device {
    std::unique_ptr<Probe> probe;
    std::vector<Route*> routes;  ///< by output
    ProbeReader::DeviceFeeds feeds;
    std::unique_ptr<ProbeReader> reader;
  };

  std::vector<std::unique_ptr<Device>> devices_;
  std::vector<std::unique_ptr<Route>> routes_;  ///< by the number of the probe
  std::vector<ProbeInput> inputs_;
};

}  // namespace merkel
