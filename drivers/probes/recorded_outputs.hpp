#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "drivers/calibration/probe_calibration.hpp"
#include "drivers/probes/forwarding_probe.hpp"
#include "drivers/probes/probe_channels.hpp"

namespace merkel {

/// A recording or a simulated press with columns for several probes, such as thumb_N and index_N:
/// feeds one or more of them, as the device that it was recorded from would.
class RecordedOutputs final : public ForwardingProbe {
 public:
  /// \param parts  the columns of each probe (ProbeChannels); empty: the recording as it is
  [[nodiscard]] static Expected<std::unique_ptr<Probe>, SetupError> split(
      std::unique_ptr<Probe> recording, const std::vector<std::string>& parts);

  [[nodiscard]] const ProbeInfo& info() const noexcept override { return infos_.front(); }
  [[nodiscard]] std::size_t outputs() const noexcept override { return infos_.size(); }
  [[nodiscard]] const ProbeInfo& info_of(std::size_t output) const noexcept override {
    return infos_[output];
  }
  [[nodiscard]] std::span<const float> taxels(const ProbeSample& sample) const override;
  /// A value that is missing or impossible is no press: its sample is 0.
  [[nodiscard]] Expected<std::size_t, ProbeError> read(std::span<ProbeSample> samples,
                                                       std::chrono::milliseconds patience) override;

 private:
  using ForwardingProbe::ForwardingProbe;
  [[nodiscard]] ProbeSample array_sample(std::size_t output, const DeviceReading& reading,
                                         const ProbeSample& from);

  std::vector<ProbeInfo> infos_;
  std::vector<ProbeCalibration> calibrations_;
  /// The columns of a tactile array; none: another probe, or an array whose recording has rows.
  struct Array {
    std::vector<ChannelName> columns;
    double area_mm2 = 1.0;
  };
  std::vector<Array> arrays_;
  std::vector<std::vector<float>> rows_;  ///< of the arrays with columns, since the last read
  std::vector<double> factors_;           ///< of the further columns, to N or mm; 0: neither
  std::vector<ProbeSample> waiting_;      ///< read, but not yet split
};

}  // namespace merkel
