#pragma once

#include <memory>

#include "core/expected.hpp"
#include "drivers/probe.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// Opens a recording or a simulated press and plays it as the options live and repeat say. Again
/// and again: the times of each round follow those of the round before, one sample period later.
/// Live, like a device: every sample arrives when the host's clock reaches its time, whether or not
/// it is read in time; the first sample is due at the first read.
/// \param open  opens it, without these options
[[nodiscard]] Expected<std::unique_ptr<Probe>, SetupError> play(
    const Uri& uri, Expected<std::unique_ptr<Probe>, SetupError> (*open)(const Uri&));

}  // namespace merkel
