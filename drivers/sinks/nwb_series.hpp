#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/encoding/encoding_parameters.hpp"
#include "core/records/record_batch.hpp"
#include "drivers/probe.hpp"
#include "drivers/sample_channels.hpp"
#include "drivers/sinks/nwb_objects.hpp"

namespace merkel::nwb {

/// A stretch of time with a label.
struct Interval {
  double start_s = 0.0;
  double stop_s = 0.0;
  std::string label;
  std::string subject = {};  ///< the name of its probe (name_of_probe), or of its neuron
};

/// "probe_0", …: the name of the probe's device in the file.
[[nodiscard]] std::string name_of_probe(std::size_t number);

/// The samples of one probe in /stimulus/presentation: a time series for each channel.
class ProbeSeries {
 public:
  /// \param only  the run has one probe, so the names of its series need no number
  ProbeSeries(Hdf5File& file, SeriesPaths& paths, const ProbeInfo& probe, std::size_t number,
              bool only);

  /// Appends a sample. A contact that ends there is added to `contacts`.
  void add(double time_s, const DeliveredSample& item, std::vector<Interval>& contacts);
  /// Ends the contact that lasts, if any.
  void end_contact(double time_s, std::vector<Interval>& contacts);

 private:
  std::vector<const SampleChannel*> press_;
  std::vector<std::unique_ptr<TimeSeries>> series_;  ///< of `press_`, then of the further columns
  std::size_t number_;
  std::optional<double> touched_s_;  ///< start of the contact
};

/// The stimulation commands of one electrode in /stimulus/presentation: amplitude and frequency of
/// its updates, the reason for which everything was off (StimulationCommand::Stop; a series of its
/// own, because Neo refuses files with the `control` of a series), and the amplitudes of its single
/// pulses if there are any. Of commands that left, also when each passed the gate.
class ElectrodeSeries {
 public:
  enum class Of : std::uint8_t { kCommanded, kSent };
  ElectrodeSeries(Hdf5File& file, SeriesPaths& paths, const Electrode& electrode,
                  const StimulationParameters& scene, Of of);

  /// \param sent  SentCommand::sent
  void add(double time_s, const StimulationCommand& command, std::chrono::nanoseconds sent);

 private:
  std::unique_ptr<TimeSeries> amplitude_;
  std::unique_ptr<TimeSeries> frequency_;
  std::unique_ptr<TimeSeries> stops_;
  std::unique_ptr<TimeSeries> sent_;
  std::unique_ptr<TimeSeries> pulses_;
};

}  // namespace merkel::nwb
