#pragma once

#include <chrono>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "drivers/calibration/calibration_watch.hpp"
#include "drivers/calibration/probe_calibration.hpp"
#include "drivers/probe.hpp"
#include "drivers/probes/tare_request.hpp"
#include "drivers/probes/taxel_readings.hpp"

namespace merkel {

/// The readings of a device for one probe: some of its channels, calibrated. Thread: probe, except
/// where noted.
class DeviceOutput {
 public:
  /// What a reading gave.
  struct Result {
    bool measured = false;  ///< its row is set; if not, a value is missing or impossible,
    bool waiting = false;   ///< or the zero of the array is being measured
    bool absent = false;    ///< the device had no value
    bool saturated = false;
    bool outside = false;                   ///< of the range of its calibration
    std::vector<std::string> notices = {};  ///< for the user
    std::span<const TaxelZeros> zeros =
        {};  ///< of its array that have changed; until the next call
  };

  /// \param further  channels that its rows carry beside its own: ProbeInfo::extra_columns
  DeviceOutput(ProbeInfo info, ProbeCalibration calibration, std::vector<DeviceChannel> further)
      : info_(std::move(info)),
        calibration_(std::move(calibration)),
        further_(std::move(further)) {}

  /// A tactile array.
  DeviceOutput(ProbeInfo info, std::vector<ChannelName> channels,
               const ChannelSelection::Taxels& array)
      : info_(std::move(info)), taxels_(std::in_place, info_.name, std::move(channels), array) {}

  /// Thread: any.
  [[nodiscard]] const ProbeInfo& info() const noexcept { return info_; }
  [[nodiscard]] const ProbeCalibration& calibration() const noexcept { return calibration_; }
  /// Why it had no value, or its array some; empty: it had.
  [[nodiscard]] const std::string& lack() const noexcept {
    return taxels_ ? taxels_->lack() : lack_;
  }
  /// Takes what the device has from now on. \return a sentence, if it lacks what the probe needs
  [[nodiscard]] std::optional<std::string> take_channels(std::span<const ChannelName> channels);
  /// Thread: any.
  void request_tare() noexcept { taxels_ ? taxels_->request_tare() : tare_.make(); }

  /// Tares if requested, and converts a reading to the columns of the probe in a row.
  [[nodiscard]] Result take(const DeviceReading& reading, const ProbeColumns& columns,
                            std::span<double> row);

 private:
  [[nodiscard]] std::optional<std::string> tare(const DeviceReading& reading);
  [[nodiscard]] Result take_taxels(const DeviceReading& reading, const ProbeColumns& columns,
                                   std::span<double> row);

  ProbeInfo info_;
  ProbeCalibration calibration_;
  std::vector<DeviceChannel> further_;
  std::optional<TaxelReadings> taxels_;
  TareRequest tare_;
  bool lacks_value_ = false;
  bool tared_ = false;  ///< since the last sample
  bool gone_ = false;   ///< the device no longer names what it needs
  std::string lack_;
  CalibrationWatch watch_;
};

}  // namespace merkel
