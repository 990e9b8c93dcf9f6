#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/expected.hpp"
#include "drivers/sink.hpp"
#include "drivers/sink_setup.hpp"

namespace merkel {

/// Opens the sink of a URI. Fails with a sentence on an unknown scheme or option, an existing file,
/// a port in use, an address that is not allowed, or a library that this build lacks. Real-time:
/// no.
[[nodiscard]] Expected<std::unique_ptr<Sink>, SetupError> open_sink(std::string_view uri,
                                                                    const SinkSetup& setup);

/// Opens the sinks of one run, in order. Fails if two of them write one file. If it records a
/// session, the files whose format needs the whole run are made from that session, after it is
/// closed. Thread: each sink its own.
[[nodiscard]] Expected<std::vector<std::unique_ptr<Sink>>, SetupError> open_sinks(
    std::span<const std::string> uris, SinkSetup setup);

/// Opens sinks that are closed one after the other: none is made from the session of another.
[[nodiscard]] Expected<std::vector<std::unique_ptr<Sink>>, SetupError> open_separate_sinks(
    std::span<const std::string> uris, const SinkSetup& setup);

/// A sink of a run without a description. \param neurons  number of the model's neurons
[[nodiscard]] Expected<std::unique_ptr<Sink>, SetupError> open_sink(std::string_view uri,
                                                                    std::uint32_t neurons,
                                                                    bool overwrite);

/// True if the sink of this URI writes the program's standard output: csv:-, csv:/dev/stdout.
[[nodiscard]] bool writes_standard_output(std::string_view uri);

/// "csv:FILE, gdf:FILE, …": all schemes, for help texts.
[[nodiscard]] std::string sink_schemes();

/// All schemes with their options, a line each, for help texts.
[[nodiscard]] std::string sink_options_help();

}  // namespace merkel
