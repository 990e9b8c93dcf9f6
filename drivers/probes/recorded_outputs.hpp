#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "core/contact/taxel_gap.hpp"
#include "drivers/calibration/calibration_watch.hpp"
#include "drivers/calibration/probe_calibration.hpp"
#include "drivers/probes/channel_selection.hpp"
#include "drivers/probes/forwarding_probe.hpp"

namespace merkel {

/// A recording or a simulated press with columns for several probes, such as thumb_N and index_N:
/// feeds one or more of them, as the device that it was recorded from would.
class RecordedOutputs final : public ForwardingProbe {
 public:
  /// \param parts  the columns of each probe (ChannelSelection); empty: the recording as it is
  /// \param calibrations  a file for each probe; empty: none
  [[nodiscard]] static Expected<std::unique_ptr<Probe>, SetupError> split(
      std::unique_ptr<Probe> recording, std::vector<ChannelSelection> parts,
      std::vector<std::string> calibrations);

  [[nodiscard]] std::span<const ProbeInfo> outputs() const noexcept override { return infos_; }
  using Probe::read;
  /// A value that is missing or impossible is no press: its sample is 0.
  [[nodiscard]] Expected<std::size_t, ProbeError> read(Readings& readings,
                                                       std::chrono::milliseconds patience) override;
  /// With the counters of a device, once a calibration does not cover a reading.
  [[nodiscard]] ProbeStatus status() const override;

 private:
  explicit RecordedOutputs(std::unique_ptr<Probe> recording)
      : ForwardingProbe(std::move(recording)),
        waiting_(columns_of(ForwardingProbe::outputs()), kAtOnce) {}
  static constexpr std::size_t kAtOnce = 256;
  [[nodiscard]] ProbeSample array_sample(std::size_t output, const DeviceReading& reading,
                                         std::size_t from, std::span<double> kPa);

  std::vector<ProbeInfo> infos_;
  std::vector<ProbeCalibration> calibrations_;
  /// The columns of a tactile array; none: another probe, or an array whose recording has rows.
  struct Array {
    std::vector<ChannelName> columns;
    double area_mm2 = 1.0;
    std::vector<TaxelGap> gaps;
  };
  std::vector<Array> arrays_;
  std::vector<double> factors_;  ///< of the further columns, to N or mm; 0: neither
  std::vector<CalibrationWatch> watches_;
  std::vector<bool> valued_;  ///< has had a value
  Readings waiting_;          ///< read, but not yet split
  std::size_t next_ = 0;      ///< of those
  mutable std::mutex mutex_;  ///< guards the counts of readings that a calibration does not cover:
  DeviceCounts counts_;
  std::vector<OutputFaults> faults_;  ///< of each output
};

}  // namespace merkel
