#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/records/probe_sample.hpp"
#include "drivers/probe.hpp"
#include "drivers/sessions/session_format.hpp"
#include "drivers/sinks/sink_setup.hpp"
#include "drivers/spike_sink.hpp"

namespace merkel {

/// The columns of recorded samples that the model does not use, of all probes: one of each name.
class ExtraColumns {
 public:
  explicit ExtraColumns(const std::vector<ProbeInfo>& probes);

  [[nodiscard]] std::size_t size() const noexcept { return names_.size(); }
  /// The label of the channel in the file. A name that belongs to a channel of every session gets a
  /// prefix.
  [[nodiscard]] std::string label(std::size_t column) const;
  /// NaN if the probe does not have the column.
  [[nodiscard]] double value(std::size_t probe, std::size_t column,
                             const ProbeSample& sample) const noexcept;

 private:
  std::vector<std::string> names_;
  std::vector<std::vector<std::size_t>> places_;  ///< in ProbeSample::extra, by probe and column
};

// The XML texts of a session (XDF), which XDF readers parse; SessionReader reads them back.

/// The file header: the facts of the run. \param afferents  as CSV
[[nodiscard]] std::string session_header(const RunDescription& run, const RunOrigin& origin,
                                         const std::string& afferents);
/// The header of one of session_streams(). \param rate_Hz  nominal; 0: irregular
[[nodiscard]] std::string stream_header(const SessionStream& stream, double rate_Hz,
                                        const ExtraColumns& extra);
/// The header of the stream of marks.
[[nodiscard]] std::string mark_header();

/// The samples of a stream.
struct StreamTally {
  std::uint64_t samples = 0;
  double first_s = 0.0;
  double last_s = 0.0;
};
/// The footer of a stream.
[[nodiscard]] std::string stream_footer(const StreamTally& tally);

}  // namespace merkel
