#pragma once

#include <atomic>
#include <string>
#include <string_view>

#include <linux/serial.h>

#include "tests/devices/umockdev/mock_machine.hpp"

namespace merkel {

/// An FTDI adapter (0403:6001) of a MockMachine: a pseudo-terminal plus the calls that it lacks.
class MockSerialAdapter final : public NodeHandler {
 public:
  /// \param name  "ttyUSB0"  \param usb_port  "1-1"
  MockSerialAdapter(MockMachine& machine, const std::string& name, const std::string& usb_port,
                    const std::string& serial_number);
  ~MockSerialAdapter() override { unplug(); }

  /// Why tests cannot use such adapters here; empty if they can. The `realpath` of umockdev 0.19.1
  /// crashes if called from libserialport 0.1.2 (both are Debian 13's).
  [[nodiscard]] static std::string obstacle();

  /// Sends text as the device.
  void send(std::string_view text) const;
  void unplug();

  bool handle_ioctl(UMockdevIoctlClient* client) override;

 private:
  MockMachine& machine_;
  std::string node_;
  std::string usb_path_;
  int terminal_ = -1;
  int modem_lines_;
  serial_struct settings_{};
};

}  // namespace merkel
