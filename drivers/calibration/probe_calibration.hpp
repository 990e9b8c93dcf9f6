#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/expected.hpp"
#include "core/records/probe_sample.hpp"
#include "drivers/protocols/device_reading.hpp"
#include "drivers/sample_channels.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// Converts a device's reading to one channel of a sample: gain · (reading − zero), in N or mm.
struct ChannelCalibration {
  DeviceChannel source = DeviceChannel::kForce;
  std::string name = {};  ///< of the source, if it has a name of its own
  double gain = 1.0;
  double zero = 0.0;
  /// Uncalibrated readings beyond this magnitude count as saturated; not set: none.
  std::optional<double> saturation;
  /// The smallest and the largest of the known points, in N or mm; not set: one point, or none.
  std::optional<std::array<double, 2>> range = {};
  /// For the user: rms of the noise, and of the residuals about the calibration line.
  double noise = 0.0;
  double residual = 0.0;
  bool from_file = false;  ///< not only the natural meaning of the device's channel

  [[nodiscard]] double apply(const DeviceReading& reading) const noexcept {
    return gain * (reading[source] - zero);
  }
  /// The name of its source without the unit: "force", "z", "thumb".
  [[nodiscard]] std::string stem() const;
  /// True if a press, in N or mm, is beyond the range by more than 2 % of it and the noise.
  /// \param either_sign  a negative one is a press too: sensors may report compression as negative
  [[nodiscard]] bool is_outside(double press, bool either_sign) const noexcept;
};

/// Converts a device's readings to samples; applied once, in the driver.
struct ProbeCalibration {
  std::string serial_number;  ///< of the calibrated device; empty: any
  std::string date;
  /// Of columns in volts or counts: keys of UnitFactors and their values. They apply before the
  /// gains, as if they were options of the device's URI.
  std::vector<std::pair<std::string, double>> factors = {};
  std::array<std::optional<ChannelCalibration>, kProbeChannels.size()> channels;  ///< of those

  /// The default for a device's channels. Depth is the device's depth, else −z (a stage whose work
  /// zero is on the skin). Force is its force, else its z force. x and y are used as they are.
  [[nodiscard]] static ProbeCalibration natural(std::uint32_t device_channels);

  /// Fills in the natural meaning of channels without a calibration.
  void complete(std::uint32_t device_channels);

  /// ProbeSample::Channel bits.
  [[nodiscard]] std::uint32_t sample_channels() const noexcept;
  [[nodiscard]] bool has_channels() const noexcept { return sample_channels() != 0U; }

  /// Values in mm and mN; the caller sets times and sequence.
  [[nodiscard]] ProbeSample apply(const DeviceReading& reading) const noexcept;
  [[nodiscard]] bool saturated(const DeviceReading& reading) const noexcept;
  /// True if the force or the depth of a sample is outside the range of its calibration.
  [[nodiscard]] bool is_outside(const ProbeSample& sample) const noexcept;
  /// ProbeSample::Channel bits of the channels that the file calibrates, by a table or a factor.
  [[nodiscard]] std::uint32_t channels_of_file() const;
};

/// Reads a calibration file (TOML, written by `merkel calibrate`).
[[nodiscard]] Expected<ProbeCalibration, SetupError> read_calibration(const std::string& path);

/// The text of a calibration file. \param comment  lines of its header, without their '#'
[[nodiscard]] std::string calibration_text(const ProbeCalibration& calibration,
                                           const std::string& comment);

}  // namespace merkel
