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

/// A USB device (1209:0001) at a MockMachine, as the kernel's usbfs gives it. Interface 0 is of the
/// vendor's class, with a bulk endpoint each way and an interrupt endpoint in; interface 1 is HID.
class MockUsbDevice final : public NodeHandler {
 public:
  static constexpr std::uint8_t kBulkIn = 0x81;
  static constexpr std::uint8_t kBulkOut = 0x01;
  static constexpr std::uint8_t kHidIn = 0x82;
  static constexpr std::uint8_t kInterruptIn = 0x83;
  /// How a transfer fails.
  static constexpr int kProtocolError = -71;  ///< −EPROTO: the bus is disturbed

  /// \param usb_port  "1-2"  \param number  of the device on its bus
  MockUsbDevice(MockMachine& machine, const std::string& usb_port, int number,
                std::string serial_number, Bytes report_descriptor = {});
  ~MockUsbDevice() override;

  [[nodiscard]] const std::string& node() const noexcept { return node_; }

  /// One packet; it waits until it is asked for.
  void send(std::uint8_t endpoint, std::string_view bytes);
  /// The endpoint is halted until that is cleared; with `again`, once more each time.
  void stall(std::uint8_t endpoint, bool again = false);
  /// The next transfer of the endpoint fails.
  void fail(std::uint8_t endpoint, int error);
  /// Another program has the interfaces.
  void set_busy(bool busy);
  void unplug();

  [[nodiscard]] std::string received();                      ///< by the bulk endpoint out
  [[nodiscard]] std::size_t waiting(std::uint8_t endpoint);  ///< transfers under way
  [[nodiscard]] std::size_t left(std::uint8_t endpoint);     ///< packets not asked for yet
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
