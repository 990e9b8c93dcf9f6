#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "core/expected.hpp"
#include "core/math/random.hpp"
#include "drivers/probe.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// A simulated press: `sim:SHAPE?option=value&…`. Sample k is taken at k/rate_hz, so that the same
/// URI always gives the same samples.
///
/// Shapes, all starting after `wait_s` and followed by `tail_s` without contact:
/// - `ramp`: down in `ramp_s`, held for `hold_s`, up in `ramp_s`;
/// - `taps`: `count` raised cosines of `tap_s`, one every `interval_s`;
/// - `sine`: `depth_mm` + `amplitude_mm`·sin(2π·`frequency_hz`·t) for `hold_s`, between ramps;
/// - `slide`: ramp down at (`x_mm`, `y_mm`), move to (`to_x_mm`, `to_y_mm`) at `speed_mm_per_s`,
///   ramp up.
/// All take `rate_hz`, `depth_mm` (or `force_N` and, for `sine`, `amplitude_N`), `x_mm`, `y_mm`,
/// and faults: `jitter_us` (uniform, on the times), `noise_um` (standard deviation, on the depth;
/// `noise_mN` on the force), `dropouts_per_s` of `dropout_ms` each, and `seed` for all three.
class SimProbe final : public Probe {
 public:
  [[nodiscard]] static Expected<std::unique_ptr<Probe>, SetupError> open(const Uri& uri);

  [[nodiscard]] const ProbeInfo& info() const noexcept override { return info_; }
  /// Never waits.
  [[nodiscard]] Expected<std::size_t, ProbeError> read(std::span<ProbeSample> samples,
                                                       std::chrono::milliseconds patience) override;

 private:
  /// The press at a time in seconds, as a multiple of the amplitude, and where it is.
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
  SimProbe(ProbeInfo info, std::function<Press(double)> press, double amplitude, double duration_s,
           double rate_hz, const Faults& faults);
  double normal() noexcept;

  ProbeInfo info_;
  std::function<Press(double)> press_;
  double amplitude_;  ///< mm, or mN when force-controlled
  double rate_hz_;
  Faults faults_;
  Random random_;
  std::uint32_t next_ = 0;  ///< number of the next sample
  std::uint32_t count_;
  double dropped_until_s_ = 0.0;
};

}  // namespace merkel
