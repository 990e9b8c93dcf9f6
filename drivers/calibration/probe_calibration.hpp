#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "core/expected.hpp"
#include "core/records/probe_sample.hpp"
#include "drivers/protocols/device_reading.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// How one number of a sample comes from a device's reading: gain · (reading − zero), in N or mm.
struct ChannelCalibration {
  DeviceChannel source = DeviceChannel::kForce;
  double gain = 1.0;
  double zero = 0.0;
  /// Readings beyond this magnitude, as read, are saturated and counted; not set: none.
  std::optional<double> saturation;
  /// For people: rms of the noise, and of what the line through the known points leaves over.
  double noise = 0.0;
  double residual = 0.0;

  [[nodiscard]] double apply(const DeviceReading& reading) const noexcept {
    return gain * (reading[source] - zero);
  }
};

/// The four numbers of a sample, in the order of ProbeSample::Channel's bits.
inline constexpr std::array<std::string_view, 4> kSampleChannelNames = {"depth", "force", "x", "y"};

/// From a device's readings to samples: applied once, in the driver.
struct ProbeCalibration {
  std::string serial_number;  ///< of the device it was made with; empty: any
  std::string date;
  std::array<std::optional<ChannelCalibration>, 4> channels;

  /// What a device's channels mean without further word: depth is its depth, else −z (a stage whose
  /// work zero is on the skin); force its force, else its z force; x and y as they are.
  [[nodiscard]] static ProbeCalibration natural(std::uint32_t device_channels);

  /// Fills up with the natural meaning what is not given.
  void complete(std::uint32_t device_channels);

  /// ProbeSample::Channel bits.
  [[nodiscard]] std::uint32_t sample_channels() const noexcept;

  /// Values in mm and mN; times and sequence are left to the caller.
  [[nodiscard]] ProbeSample apply(const DeviceReading& reading) const noexcept;
  [[nodiscard]] bool saturated(const DeviceReading& reading) const noexcept;
};

/// Reads a calibration file (TOML, as `merkel calibrate` writes it).
[[nodiscard]] Expected<ProbeCalibration, SetupError> read_calibration(const std::string& path);

/// The text of a calibration file. \param comment  lines for its head, each without its '#'
[[nodiscard]] std::string calibration_text(const ProbeCalibration& calibration,
                                           const std::string& comment);

}  // namespace merkel
