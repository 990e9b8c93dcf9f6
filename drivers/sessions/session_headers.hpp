#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/probe.hpp"
#include "drivers/sessions/afferent_table.hpp"
#include "drivers/sessions/session_format.hpp"
#include "drivers/sink.hpp"
#include "drivers/sink_setup.hpp"

namespace merkel {

// The XML texts of a session (XDF), which XDF readers parse; SessionReader reads them back.

/// The file header: the facts of the run. \param afferents  as CSV
[[nodiscard]] std::string session_header(const RunDescription& run, const RunOrigin& origin,
                                         const std::string& afferents);
/// A file header with another fact. \param replaces  true for the value of a fact of that name that
/// the new one replaces
[[nodiscard]] std::string header_with_fact(const std::string& header, std::string_view name,
                                           std::string_view value,
                                           const std::function<bool(std::string_view)>& replaces);
/// Whether a run's times are those of the host's clock: its origin is on both clocks then. A copy
/// of a session has the clocks of its recording. A session of such a run has the fact `live`.
[[nodiscard]] bool is_live(const RunDescription& run, const RunOrigin& origin);

/// The header of one of session_streams().
[[nodiscard]] std::string stream_header(const SessionStream& stream,
                                        const std::vector<AfferentRow>& afferents);
/// The header of a probe's stream.
[[nodiscard]] std::string probe_stream_header(const SessionStream& stream, std::uint32_t number,
                                              const ProbeInfo& probe);
/// The header of the stream of states of such streams.
[[nodiscard]] std::string states_header(const SessionStream& stream);
/// The header of the stream of marks.
[[nodiscard]] std::string mark_header();
[[nodiscard]] std::string clock_header();

/// The samples of a stream.
struct StreamTally {
  std::uint64_t samples = 0;
  double first_s = 0.0;
  double last_s = 0.0;
};
/// The footer of a stream.
[[nodiscard]] std::string stream_footer(const StreamTally& tally);

}  // namespace merkel
