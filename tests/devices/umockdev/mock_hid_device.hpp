#pragma once

#include <atomic>
#include <string>

#include "tests/devices/umockdev/mock_machine.hpp"

namespace merkel {

/// A HID device of a MockMachine, with the interface of the kernel's hidraw.
class MockHidDevice final : public NodeHandler {
 public:
  /// \param name  "hidraw0"  \param usb_port  "1-3"  \param descriptor  of its reports
  MockHidDevice(MockMachine& machine, const std::string& name, const std::string& usb_port,
                const std::string& serial_number, const Bytes& descriptor);
  ~MockHidDevice() override;

  [[nodiscard]] static std::string uri() { return "hid:16c0:0486"; }
  [[nodiscard]] const std::string& node() const noexcept { return node_; }

  /// Sends one input report. As in hidraw, it is lost if sixteen reports are waiting.
  void send(const Bytes& report) const;
  void unplug();

  bool handle_ioctl(UMockdevIoctlClient* client) override;
  bool handle_read(UMockdevIoctlClient* client) override;
  bool handle_write(UMockdevIoctlClient* client) override;

 private:
  MockMachine& machine_;
  std::string node_;
  std::string usb_path_;
  Bytes descriptor_;
  int pipe_ = -1;
  std::atomic<bool> gone_{false};
};

}  // namespace merkel
