#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "core/records/mark.hpp"
#include "drivers/stimulation_switch.hpp"

namespace merkel {

/// Requests that a sink can send to its run. No call waits for the simulation, and the simulation
/// waits for no call. Thread: any.
class RunControl {
 public:
  static constexpr std::size_t kMaxWatched = 4;
  enum class Link : std::uint8_t { kRecording, kConnected, kUnplugged };

  RunControl() = default;
  RunControl(const RunControl&) = delete;
  RunControl& operator=(const RunControl&) = delete;
  virtual ~RunControl() = default;

  /// From now on the sink receives samples of these neurons (numbered from 1 through all patches,
  /// at most kMaxWatched) if it subscribed to kNeurons.
  virtual void watch(std::span<const std::uint32_t> neurons) noexcept = 0;
  /// Tares a probe: its present reading becomes zero. False if there is no such probe or it is a
  /// recording.
  [[nodiscard]] virtual bool tare(std::size_t probe) = 0;
  /// Sends a mark to every sink that subscribed to kMarks.
  virtual void mark(const Mark& mark) = 0;
  /// Reports a sentence to the user.
  virtual void notice(const std::string& sentence) = 0;
  /// Stops the stimulation of the run, and starts it again.
  [[nodiscard]] virtual StimulationSwitch& stimulation() noexcept = 0;
  /// The present connection of a probe.
  [[nodiscard]] virtual Link link(std::size_t probe) const = 0;
};

}  // namespace merkel
