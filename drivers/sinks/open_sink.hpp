#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "core/expected.hpp"
#include "drivers/sinks/sink_setup.hpp"
#include "drivers/spike_sink.hpp"

namespace merkel {

/// Opens the sink that a URI names. Real-time: no. Fails with a sentence on an unknown scheme or
/// option, a file that exists, a port in use, an address that is not allowed, or a library that
/// this build lacks.
[[nodiscard]] Expected<std::unique_ptr<SpikeSink>, SetupError> open_sink(std::string_view uri,
                                                                         const SinkSetup& setup);

/// The same for a run without a description. \param neurons  of the model
[[nodiscard]] Expected<std::unique_ptr<SpikeSink>, SetupError> open_sink(std::string_view uri,
                                                                         std::uint32_t neurons,
                                                                         bool overwrite);

/// "csv:FILE, gdf:FILE, …": the schemes there are, for help texts.
[[nodiscard]] std::string sink_schemes();

}  // namespace merkel
