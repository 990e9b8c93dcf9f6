#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "drivers/transports/transport.hpp"

namespace merkel {

/// The settings of a serial port; always 8 data bits, no parity, one stop bit.
struct SerialSettings {
  std::string device;  ///< as given; never made canonical
  int baud = 115200;
};

/// Opens a serial port with libserialport. A pseudo-terminal has no modem lines, and libserialport
/// refuses it; it is opened with termios (pty_port.hpp).
[[nodiscard]] Expected<std::unique_ptr<Transport>, SetupError> open_serial(
    const SerialSettings& settings);

/// Opens any port with libserialport.
[[nodiscard]] Expected<std::unique_ptr<Transport>, SetupError> open_serial_port(
    const SerialSettings& settings);

/// A serial port of this machine.
struct SerialPortInfo {
  std::string device;
  std::string description;
  std::string serial_number;
  int vendor = -1;  ///< USB; −1: not a USB port
  int product = -1;
};

[[nodiscard]] std::vector<SerialPortInfo> list_serial_ports();

}  // namespace merkel
