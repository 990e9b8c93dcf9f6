#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "core/expected.hpp"
#include "drivers/sink.hpp"
#include "drivers/sink_setup.hpp"
#include "drivers/sinks/run_journal.hpp"

namespace merkel {

/// The zero of times in files that --time-zero names, or a sentence.
[[nodiscard]] Expected<TimeZero, std::string> time_zero_named(const std::string& name);

/// Writes a run that is over to sinks. Reports the errors. \param setup  but for the journal
/// \param spikes  counts those of the run
/// \return an exit code
[[nodiscard]] int export_run(const std::shared_ptr<RunJournal>& run, const RunOrigin& origin,
                             std::span<const std::string> sinks, SinkSetup setup,
                             std::uint64_t& spikes);

}  // namespace merkel
