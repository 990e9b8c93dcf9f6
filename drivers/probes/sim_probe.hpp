#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <utility>

#include "core/expected.hpp"
#include "core/math/random.hpp"
#include "drivers/probe.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// The shapes and options of sim: URIs, for --help. A test opens each of them.
inline constexpr const char* kSimProbeHelp =
    "Simulated presses, sim:SHAPE?option=value&...:\n"
    "  ramp   down, hold, up: ramp_s (0.02), hold_s (2)\n"
    "  taps   raised cosines: count (6), tap_s (0.1), interval_s (0.4)\n"
    "  sine   oscillates during the hold: ramp_s (0.15), hold_s (2), frequency_hz (5),\n"
    "         amplitude_mm (0.3) or, with force_N, amplitude_N (0.03)\n"
    "  slide  moves during the hold: ramp_s (0.15), to_x_mm (27), to_y_mm (y_mm),\n"
    "         speed_mm_per_s (12)\n"
    "  scan   slides again and again, lifted in between: ramp_s (0.15), length_mm (24), around x_mm,\n"
    "         y_mm, speed_mm_per_s (40), direction_deg (0), passes (1), step_mm (0.2) to\n"
    "         the next pass, return_s (0.1)\n"
    "  grasp  five fingers and the palm, each as taps: count (6), tap_s (0.9), interval_s (1.2),\n"
    "         delay_ms (60) between one and the next; channels thumb_mm, index_mm, middle_mm,\n"
    "         ring_mm, little_mm, palm_mm or, with force_N, thumb_N, …: #thumb_mm at the end\n"
    "         chooses one\n"
    "  pad    a tactile array under a rolling ball: columns (16), rows (16), pitch_mm (1), force_N "
    "(1),\n"
    "         contact_mm (4: radius), roll_mm (3), count (6), tap_s (0.9), interval_s (1.2), "
    "wait_s,\n"
    "         tail_s, rate_hz, live, repeat as below; noise_kPa (0), seed (1); for\n"
    "         tip = \"taxels\"\n"
    "  all    depth_mm (1.5), or force_N, or both (force as depth^1.5); x_mm (15; of slide 3), "
    "y_mm (10),\n"
    "         wait_s (0.2) before, tail_s (0.5) after, rate_hz (1000); live (0; 1: in real time,\n"
    "         like a device); repeat (1; 0: without end); faults: jitter_us (0), noise_um (0)\n"
    "         or, with force_N alone, noise_mN (0), dropouts_per_s (0), dropout_ms (100), seed (1)";

/// A simulated press: `sim:SHAPE?option=value&…`, as kSimProbeHelp describes. Sample k is taken at
/// k/rate_hz; the same URI always gives the same samples. Jitter is uniform, noise has the given
/// standard deviation.
class SimProbe final : public Probe {
 public:
  [[nodiscard]] static Expected<std::unique_ptr<Probe>, SetupError> open(const Uri& uri);

  [[nodiscard]] std::span<const ProbeInfo> outputs() const noexcept override { return {&info_, 1}; }
  /// Never waits.
  using Probe::read;
  [[nodiscard]] Expected<std::size_t, ProbeError> read(Readings& readings,
                                                       std::chrono::milliseconds patience) override;

 private:
  /// Takes the sample of a nominal time, in seconds, and the values of its further columns or its
  /// taxels. \return false: it drops out
  using Take = std::function<bool(double nominal_s, ProbeSample& sample, std::span<double> others)>;
  SimProbe(ProbeInfo info, Take take, double rate_hz, double count)
      : info_(std::move(info)),
        take_(std::move(take)),
        rate_hz_(rate_hz),
        count_(static_cast<std::uint32_t>(count)) {}
  /// sim:pad, a tactile array under a ball that presses and rolls. The pressure is that of Hertz;
  /// the mean over a taxel is taken at nine of its points.
  [[nodiscard]] static Expected<std::unique_ptr<Probe>, SetupError> open_pad(const Uri& uri);

  ProbeInfo info_;
  Take take_;
  double rate_hz_;
  std::uint32_t next_ = 0;  ///< number of the next sample
  std::uint32_t count_;
};

/// The sum of twelve uniform numbers minus its mean (Irwin-Hall): nearly normal, and portable.
[[nodiscard]] double irwin_hall(Random& random) noexcept;

}  // namespace merkel
