#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "core/expected.hpp"
#include "drivers/sink.hpp"
#include "drivers/sinks/sink_setup.hpp"

namespace merkel {

/// Opens the sink of a URI. Fails with a sentence on an unknown scheme or option, an existing file,
/// a port in use, an address that is not allowed, or a library that this build lacks. Real-time:
/// no.
[[nodiscard]] Expected<std::unique_ptr<Sink>, SetupError> open_sink(std::string_view uri,
                                                                    const SinkSetup& setup);

/// The same for a run without a description. \param neurons  number of the model's neurons
[[nodiscard]] Expected<std::unique_ptr<Sink>, SetupError> open_sink(std::string_view uri,
                                                                    std::uint32_t neurons,
                                                                    bool overwrite);

/// "csv:FILE, gdf:FILE, …": all schemes, for help texts.
[[nodiscard]] std::string sink_schemes();

/// All schemes with their options, a line each, for help texts.
[[nodiscard]] std::string sink_options_help();

}  // namespace merkel
