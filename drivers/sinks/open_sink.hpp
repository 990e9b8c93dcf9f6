#pragma once

#include <memory>
#include <string_view>

#include "core/expected.hpp"
#include "drivers/spike_sink.hpp"

namespace merkel {

/// Opens the sink that a URI names: csv:FILE. Real-time: no.
/// \param overwrite  whether an existing file may be replaced
[[nodiscard]] Expected<std::unique_ptr<SpikeSink>, SetupError> open_sink(
    std::string_view uri, const NeuronNumbering& numbering, bool overwrite);

}  // namespace merkel
