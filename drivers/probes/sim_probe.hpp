#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

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
  /// The press at a time in seconds, as a multiple of the amplitude, and its position.
  struct Press {
    double level = 0.0;
    double x_mm = 0.0;
    double y_mm = 0.0;
  };
  struct Faults {
    double jitter_s = 0.0;
    double noise = 0.0;  ///< mm or mN
    double dropouts_per_s = 0.0;
    double dropout_s = 0.0;
    std::uint64_t seed = 1;
  };
  /// A shape of the press over time.
  struct Shape {
    std::function<Press(double)> press;
    double length_s = 0.0;
  };
  static Shape taps(UriOptions& options, double wait_s, Press place, bool grasp);
  static Shape scan(UriOptions& options, double wait_s, Press place);
  /// A ramp, a sine or a slide. \param amplitude  in mm, or in mN if `force`
  static Shape held_press(UriOptions& options, const std::string& shape, double wait_s, Press place,
                          double amplitude, bool force);
  static Faults read_faults(UriOptions& options, bool force, double rate_hz);
  SimProbe(ProbeInfo info, std::function<Press(double)> press, double amplitude, double duration_s,
           double rate_hz, const Faults& faults);
  double normal() noexcept;
  void grasp(double time_s, std::span<double> further);

  /// One of several presses, in a further column.
  struct Finger {
    std::string_view name;
    double share;  ///< of the amplitude
  };
  static constexpr std::array<Finger, 6> kHand = {{{"thumb", 1.0},
                                                   {"index", 1.0},
                                                   {"middle", 0.9},
                                                   {"ring", 0.8},
                                                   {"little", 0.7},
                                                   {"palm", 2.0}}};

  ProbeInfo info_;
  std::function<Press(double)> press_;
  double amplitude_;                      ///< mm, or mN when force-controlled
  std::optional<double> finger_delay_s_;  ///< of a grasp
  std::optional<double> force_mN_;        ///< at the amplitude, for a press with depth and force
  double rate_hz_;
  Faults faults_;
  Random random_;
  std::uint32_t next_ = 0;  ///< number of the next sample
  std::uint32_t count_;
  double dropped_until_s_ = 0.0;
};

}  // namespace merkel
