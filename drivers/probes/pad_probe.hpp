#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/expected.hpp"
#include "core/math/random.hpp"
#include "drivers/probe.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// A simulated tactile array under a ball that presses and rolls: `sim:pad?option=value&…`, as
/// kSimProbeHelp describes. The pressure is that of Hertz; the mean over a taxel is taken at nine
/// of its points. The same URI always gives the same samples.
class PadProbe final : public Probe {
 public:
  [[nodiscard]] static Expected<std::unique_ptr<Probe>, SetupError> open(const Uri& uri);

  [[nodiscard]] std::span<const ProbeInfo> outputs() const noexcept override { return {&info_, 1}; }
  /// Never waits.
  using Probe::read;
  [[nodiscard]] Expected<std::size_t, ProbeError> read(Readings& readings,
                                                       std::chrono::milliseconds patience) override;

 private:
  struct Options {
    int columns = 16, rows = 16;
    double pitch_mm = 1.0;
    double force_mN = 1000.0;
    double contact_mm = 4.0;  ///< radius of the contact at that force
    double roll_mm = 3.0;     ///< to each side, along x
    int count = 6;
    double press_s = 0.9, interval_s = 1.2, wait_s = 0.2, tail_s = 0.5;
    double rate_Hz = 1000.0;
    double noise_kPa = 0.0;
    std::uint64_t seed = 1;

    [[nodiscard]] double samples() const noexcept;
  };
  PadProbe(ProbeInfo info, const Options& options);
  /// \return the force, mN
  [[nodiscard]] double press(double time_s, std::span<double> kPa);

  ProbeInfo info_;
  Options options_;
  Random random_;
  std::uint32_t next_ = 0;
  std::uint32_t count_;
};

}  // namespace merkel
