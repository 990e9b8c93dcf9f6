#pragma once

#include <memory>

#include "core/expected.hpp"
#include "drivers/transports/serial_port.hpp"
#include "drivers/transports/transport.hpp"

namespace merkel {

/// True if a device name leads to a pseudo-terminal.
[[nodiscard]] bool is_pty(const std::string& device);

/// Opens a pseudo-terminal like a serial port; the other end sees the baud rate.
[[nodiscard]] Expected<std::unique_ptr<Transport>, SetupError> open_pty_port(
    const SerialSettings& settings);

}  // namespace merkel
