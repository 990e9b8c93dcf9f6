#pragma once

#include <chrono>
#include <cstdint>
#include <string_view>
#include <type_traits>

namespace merkel {

/// An event in a run that matters to readers of the spikes: plain data that crosses threads.
struct LoopEvent {
  enum class Kind : std::uint16_t {
    kRelease,        ///< a probe was released after sending nothing for too long
    kResume,         ///< its samples returned
    kGap,            ///< ticks were skipped: the loop had fallen too far behind
    kNeuronReset,    ///< a neuron was reset to rest after a non-finite state
    kZeroUncertain,  ///< a contact may be drift (ProbeSample::kZeroUncertain)
    kZeroCertain,    ///< it is over, or a contact
  };

  std::chrono::nanoseconds time{0};    ///< probe time
  std::chrono::nanoseconds length{0};  ///< of a gap; of what a resume or kZeroCertain ends
  std::uint32_t subject = 0;           ///< probe number from 0; neuron number from 1
  Kind kind = Kind::kRelease;

  /// Where the length begins: at a gap, but before a resume and kZeroCertain.
  [[nodiscard]] constexpr std::chrono::nanoseconds begin() const noexcept {
    return kind == Kind::kResume || kind == Kind::kZeroCertain ? time - length : time;
  }
  friend bool operator==(const LoopEvent&, const LoopEvent&) = default;
};

static_assert(std::is_trivially_copyable_v<LoopEvent>);

/// "release", "resume", "gap", "neuron_reset", "zero_uncertain", "zero_certain".
[[nodiscard]] constexpr std::string_view name_of(LoopEvent::Kind kind) noexcept {
  switch (kind) {
    case LoopEvent::Kind::kRelease:
      return "release";
    case LoopEvent::Kind::kResume:
      return "resume";
    case LoopEvent::Kind::kGap:
      return "gap";
    case LoopEvent::Kind::kNeuronReset:
      return "neuron_reset";
    case LoopEvent::Kind::kZeroUncertain:
      return "zero_uncertain";
    case LoopEvent::Kind::kZeroCertain:
      return "zero_certain";
  }
  return "";
}

}  // namespace merkel
