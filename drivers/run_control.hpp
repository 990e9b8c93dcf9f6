#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace merkel {

/// A moment that a person marked, such as the beginning of a trial.
struct Mark {
  std::chrono::nanoseconds time{0};  ///< probe time
  std::string label;                 ///< UTF-8, one line
};

/// What a sink may ask of the run that it belongs to. No call waits for the simulation, and the
/// simulation waits for none. Thread: any.
class RunControl {
 public:
  static constexpr std::size_t kMostWatched = 4;
  enum class Link : std::uint8_t { kRecording, kConnected, kUnplugged };

  RunControl() = default;
  RunControl(const RunControl&) = delete;
  RunControl& operator=(const RunControl&) = delete;
  virtual ~RunControl() = default;

  /// From now on the sink gets samples of these neurons (numbers through all patches, from 1; at
  /// most kMostWatched), if it subscribed to kNeurons.
  virtual void watch(std::span<const std::uint32_t> neurons) noexcept = 0;
  /// Takes a probe's present reading as zero. False where there is no such probe, or it is a
  /// recording.
  [[nodiscard]] virtual bool tare(std::size_t probe) = 0;
  /// Gives a mark to every sink that subscribed to kMarks.
  virtual void mark(const Mark& mark) = 0;
  /// How a probe is connected at this moment.
  [[nodiscard]] virtual Link link(std::size_t probe) const = 0;
};

}  // namespace merkel
