#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "core/expected.hpp"
#include "drivers/probe.hpp"

namespace merkel {

/// Opens the probe that a URI names: replay:FILE, sim:SHAPE. With the option live=1, either plays
/// as a device would: in real time, and losing what nobody takes. Real-time: no.
[[nodiscard]] Expected<std::unique_ptr<Probe>, SetupError> open_probe(std::string_view uri);

}  // namespace merkel
