#pragma once

#include <deque>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "tests/devices/umockdev/mock_machine.hpp"

struct usbdevfs_urb;

namespace merkel {

/// A USB device (1209:0001) of a MockMachine, with the interface of the kernel's usbfs. Interface 0
/// is vendor-specific, with bulk endpoints in both directions and an interrupt IN endpoint;
/// interface 1 is HID.
class MockUsbDevice final : public NodeHandler {
 public:
  static constexpr std::uint8_t kBulkIn = 0x81;
  static constexpr std::uint8_t kBulkOut = 0x01;
  static constexpr std::uint8_t kHidIn = 0x82;
  static constexpr std::uint8_t kInterruptIn = 0x83;
  /// How a transfer fails.
  static constexpr int kProtocolError = -71;  ///< −EPROTO: bus error

  /// \param usb_port  "1-2"  \param number  of the device on its bus
  MockUsbDevice(MockMachine& machine, const std::string& usb_port, int number,
                std::string serial_number, Bytes report_descriptor = {});
  ~MockUsbDevice() override;

  [[nodiscard]] const std::string& node() const noexcept { return node_; }

  /// Queues one packet until it is requested.
  void send(std::uint8_t endpoint, std::string_view bytes);
  /// Halts the endpoint until the halt is cleared; with `again`, repeatedly.
  void stall(std::uint8_t endpoint, bool again = false);
  /// Makes the next transfer of the endpoint fail.
  void fail(std::uint8_t endpoint, int error);
  /// Simulates that another program has claimed the interfaces.
  void set_busy(bool busy);
  void unplug();

  [[nodiscard]] std::string received();                      ///< on the bulk OUT endpoint
  [[nodiscard]] std::size_t waiting(std::uint8_t endpoint);  ///< submitted transfers
  [[nodiscard]] std::size_t left(std::uint8_t endpoint);     ///< packets not yet requested
  [[nodiscard]] std::size_t halts_cleared();

  bool handle_ioctl(UMockdevIoctlClient* client) override;

 private:
  struct Transfer {
    UMockdevIoctlData* urb = nullptr;
    UMockdevIoctlData* buffer = nullptr;
    bool done = false;

    [[nodiscard]] usbdevfs_urb& request() const;
  };
  struct Endpoint {
    std::deque<std::string> packets;
    bool halted = false;
    bool halted_again = false;
    int error = 0;
  };

  int answer(unsigned long request, UMockdevIoctlData* argument);
  int submit(UMockdevIoctlData* argument);
  int discard(UMockdevIoctlData* argument);
  int reap(UMockdevIoctlData* argument);
  void control(const Transfer& transfer) const;
  void move_bytes();
  static void finish(Transfer& transfer, int status, std::size_t length);
  void show_readiness();

  MockMachine& machine_;
  std::string node_;
  std::string usb_path_;
  std::string serial_number_;
  Bytes report_descriptor_;
  int pipe_ = -1;
  std::mutex mutex_;  ///< guards what follows: umockdev's thread works on it, and the test's
  std::deque<Transfer> transfers_;
  std::map<std::uint8_t, Endpoint> endpoints_;
  std::string received_;
  std::size_t halts_cleared_ = 0;
  bool busy_ = false;
  bool gone_ = false;
};

}  // namespace merkel
