#pragma once

#include <chrono>
#include <cstdint>
#include <deque>

namespace merkel {

/// Decides whether what a device sends can be trusted. Of the bytes of a wrong baud rate, or of
/// noise, a few parse as readings by chance, and a few readings are enough for a touch.
///
/// The stream is distrusted while at least `share` of its frames are bad (damaged, impossible or
/// out of order), over the last `window` or the last 16 frames, whichever is longer. It is trusted
/// again after a whole window in which less than half of that share was bad.
/// Real-time: no. Thread: probe.
class StreamQuality {
 public:
  struct Parameters {
    double share = 0.5;                     ///< of bad frames; above 1: always trusted
    std::chrono::milliseconds window{500};  ///< for a stream of at least 32 frames per second
  };
  using Time = std::chrono::nanoseconds;

  explicit StreamQuality(const Parameters& parameters) noexcept : parameters_(parameters) {}

  /// Adds the frames of a read. True if trusted() has changed.
  bool add(std::uint64_t good, std::uint64_t bad, Time now);
  [[nodiscard]] bool trusted() const noexcept { return trusted_; }
  /// Share of bad frames in the window; 0 without frames.
  [[nodiscard]] double bad_share() const noexcept;

 private:
  static constexpr std::uint64_t kMinFrames = 16;
  static constexpr std::uint64_t kMinToJudge = 8;
  static constexpr int kSlices = 10;  ///< of a window
  struct Slice {
    Time begin{0};
    std::uint64_t good = 0;
    std::uint64_t bad = 0;
  };

  Parameters parameters_;
  std::deque<Slice> slices_;
  std::uint64_t good_ = 0;  ///< in all slices
  std::uint64_t bad_ = 0;
  bool trusted_ = true;
  Time distrusted_since_{0};
};

}  // namespace merkel
