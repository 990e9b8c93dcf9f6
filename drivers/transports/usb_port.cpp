#include "drivers/transports/usb_port.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <deque>
#include <utility>
#include <vector>

#include <libusb-1.0/libusb.h>

#include "drivers/transports/descriptor.hpp"

namespace merkel {
namespace {

constexpr std::size_t kTransfers = 8;
constexpr int kTransferBytes = 512;
constexpr unsigned kWritePatience_ms = 1000;
constexpr int kMaxStalls = 16;  ///< consecutive; then the device counts as disconnected

class UsbPort final : public Transport {
 public:
  UsbPort(UsbName name, const UsbEndpoints& endpoints)
      : name_(std::move(name)), endpoints_(endpoints) {
    info_.name = "usb:" + name_.text();
    info_.note = std::string(kind()) + " transfers";
  }
  ~UsbPort() override { close(); }

  [[nodiscard]] Expected<std::size_t, Disconnected> read(
      std::span<std::uint8_t> bytes, std::chrono::nanoseconds patience) override {
    if (received_.empty()) handle_events(patience);
    if (stalled_ && !clear_stall()) gone_ = true;
    const std::size_t count = std::min(bytes.size(), received_.size());
    std::copy_n(received_.begin(), count, bytes.begin());
    received_.erase(received_.begin(), received_.begin() + static_cast<std::ptrdiff_t>(count));
    if (count == 0 && gone_) return Unexpected<Disconnected>(Disconnected{});
    return count;
  }

  [[nodiscard]] Expected<void, Disconnected> write(std::span<const std::uint8_t> bytes) override {
    if (endpoints_.out == 0) return {};
    Bytes copy(bytes.begin(), bytes.end());
    int done = 0;
    const auto transfer = endpoints_.interrupt ? libusb_interrupt_transfer : libusb_bulk_transfer;
    int result = transfer(device_, endpoints_.out, copy.data(), static_cast<int>(copy.size()),
                          &done, kWritePatience_ms);
    if (result == LIBUSB_ERROR_PIPE && libusb_clear_halt(device_, endpoints_.out) == 0) {
      result = transfer(device_, endpoints_.out, copy.data() + done,
                        static_cast<int>(copy.size()) - done, &done, kWritePatience_ms);
    }
    if (result != 0) return Unexpected<Disconnected>(Disconnected{});
    return {};
  }

  [[nodiscard]] Expected<void, SetupError> reopen() override {
    close();
    // A context learns of later devices only from udev's daemon, which small systems lack. A new
    // context scans the bus itself.
    if (const int error = libusb_init(&context_); error != 0) {
      context_ = nullptr;
      return unavailable(std::string("USB cannot be used here: ") + libusb_strerror(error));
    }
    libusb_device** devices = nullptr;
    const auto count = libusb_get_device_list(context_, &devices);
    int error = LIBUSB_ERROR_NO_DEVICE;
    for (std::ptrdiff_t i = 0; i < count && device_ == nullptr; ++i) {
      error = try_device(devices[i], error);
    }
    if (count >= 0) libusb_free_device_list(devices, 1);
    if (device_ == nullptr) return Unexpected<SetupError>(error_of(error));
    if (auto there = check_endpoints(); !there) {
      close();
      return there;
    }
    static_cast<void>(libusb_set_auto_detach_kernel_driver(device_, 1));
    if (const int claimed = libusb_claim_interface(device_, endpoints_.interface); claimed != 0) {
      close();
      return Unexpected<SetupError>(error_of(claimed));
    }
    claimed_ = true;
    name_.serial_number = info_.serial_number;
    for (Slot& slot : slots_) {
      slot.port = this;
      slot.transfer = libusb_alloc_transfer(0);
      if (slot.transfer == nullptr) continue;
      const auto fill =
          endpoints_.interrupt ? libusb_fill_interrupt_transfer : libusb_fill_bulk_transfer;
      fill(slot.transfer, device_, endpoints_.in, slot.bytes.data(), kTransferBytes, finished,
           &slot, 0);
      submit(slot);
    }
    return {};
  }

 private:
  using Bytes = std::vector<std::uint8_t>;
  struct Slot {
    UsbPort* port = nullptr;
    libusb_transfer* transfer = nullptr;
    bool under_way = false;
    std::array<std::uint8_t, kTransferBytes> bytes{};
  };

  [[nodiscard]] const char* kind() const noexcept {
    return endpoints_.interrupt ? "interrupt" : "bulk";
  }

  /// Checks that the interface and its endpoints exist.
  [[nodiscard]] Expected<void, SetupError> check_endpoints() const {
    libusb_config_descriptor* configuration = nullptr;
    if (libusb_get_active_config_descriptor(libusb_get_device(device_), &configuration) != 0) {
      return unavailable(info_.name + " is not configured: plug it in again");
    }
    const auto missing = missing_endpoint(*configuration);
    libusb_free_config_descriptor(configuration);
    if (missing.empty()) return {};
    return bad_input(
        info_.name + " has no " + missing + ": lsusb -v -d " + name_.text() +
        " lists its endpoints; select one with the options interface, in, out and transfer");
  }

  /// The missing part; empty if none.
  [[nodiscard]] std::string missing_endpoint(const libusb_config_descriptor& configuration) const {
    const int type =
        endpoints_.interrupt ? LIBUSB_TRANSFER_TYPE_INTERRUPT : LIBUSB_TRANSFER_TYPE_BULK;
    for (int i = 0; i < configuration.bNumInterfaces; ++i) {
      const libusb_interface& interface = configuration.interface[i];
      if (interface.num_altsetting < 1) continue;
      const libusb_interface_descriptor& setting = interface.altsetting[0];
      if (setting.bInterfaceNumber != endpoints_.interface) continue;
      const auto has = [&](std::uint8_t address) {
        return std::any_of(setting.endpoint, setting.endpoint + setting.bNumEndpoints,
                           [&](const libusb_endpoint_descriptor& endpoint) {
                             return endpoint.bEndpointAddress == address &&
                                    (endpoint.bmAttributes & LIBUSB_TRANSFER_TYPE_MASK) == type;
                           });
      };
      for (const std::uint8_t address : {endpoints_.in, endpoints_.out}) {
        if (address == 0 || has(address)) continue;
        return std::string(kind()) + " endpoint " + std::to_string(address);
      }
      return {};
    }
    return "interface " + std::to_string(endpoints_.interface);
  }

  /// Opens a device if it matches. Returns the error if not.
  int try_device(libusb_device* device, int error) {
    libusb_device_descriptor descriptor{};
    if (libusb_get_device_descriptor(device, &descriptor) != 0) return error;
    if (descriptor.idVendor != name_.vendor || descriptor.idProduct != name_.product) {
      return error;
    }
    libusb_device_handle* handle = nullptr;
    if (const int opened = libusb_open(device, &handle); opened != 0) {
      node_ = usb_node(libusb_get_bus_number(device), libusb_get_device_address(device));
      return opened;
    }
    std::array<unsigned char, 128> text{};
    const int length =
        descriptor.iSerialNumber == 0
            ? 0
            : libusb_get_string_descriptor_ascii(handle, descriptor.iSerialNumber, text.data(),
                                                 static_cast<int>(text.size()));
    const std::string serial_number(text.begin(), text.begin() + std::max(length, 0));
    if (!name_.serial_number.empty() && serial_number != name_.serial_number) {
      libusb_close(handle);
      return error;
    }
    info_.serial_number = serial_number;
    device_ = handle;
    return 0;
  }

  [[nodiscard]] SetupError error_of(int error) const {
    switch (error) {
      case LIBUSB_ERROR_ACCESS:
        return port_error(node_, EACCES);
      case LIBUSB_ERROR_BUSY:
        return port_error(info_.name, EBUSY);
      case LIBUSB_ERROR_NO_DEVICE:
      case LIBUSB_ERROR_NOT_FOUND:
        return port_error(info_.name, ENODEV);
      default:
        return {.kind = SetupError::Kind::kUnavailable,
                .sentence = "cannot open " + info_.name + ": " + libusb_strerror(error)};
    }
  }

  void submit(Slot& slot) {
    slot.under_way = libusb_submit_transfer(slot.transfer) == 0;
    if (!slot.under_way) gone_ = true;
  }

  static void LIBUSB_CALL finished(libusb_transfer* transfer) {
    Slot& slot = *static_cast<Slot*>(transfer->user_data);
    UsbPort& port = *slot.port;
    slot.under_way = false;
    switch (transfer->status) {
      case LIBUSB_TRANSFER_COMPLETED:
        port.stalls_ = 0;
        port.received_.insert(port.received_.end(), slot.bytes.begin(),
                              slot.bytes.begin() + transfer->actual_length);
        if (!port.closing_) port.submit(slot);
        return;
      case LIBUSB_TRANSFER_STALL:
        port.stalled_ = true;  // cleared outside the callback, which must not block
        return;
      case LIBUSB_TRANSFER_TIMED_OUT:
      case LIBUSB_TRANSFER_OVERFLOW:
        if (!port.closing_) port.submit(slot);
        return;
      default:
        port.gone_ = true;
    }
  }

  bool clear_stall() {
    stalled_ = false;
    if (++stalls_ > kMaxStalls || libusb_clear_halt(device_, endpoints_.in) != 0) return false;
    for (Slot& slot : slots_) {
      if (!slot.under_way) submit(slot);
    }
    return true;
  }

  void handle_events(std::chrono::nanoseconds patience) {
    const auto microseconds = std::max<std::int64_t>(patience / std::chrono::microseconds{1}, 0);
    timeval timeout{};
    timeout.tv_sec = static_cast<time_t>(microseconds / 1'000'000);
    timeout.tv_usec = static_cast<suseconds_t>(microseconds % 1'000'000);
    static_cast<void>(libusb_handle_events_timeout_completed(context_, &timeout, nullptr));
  }

  void close() noexcept {
    if (device_ != nullptr) close_device();
    if (context_ != nullptr) libusb_exit(std::exchange(context_, nullptr));
  }

  void close_device() noexcept {
    closing_ = true;
    for (Slot& slot : slots_) {
      if (slot.under_way) static_cast<void>(libusb_cancel_transfer(slot.transfer));
    }
    for (int rounds = 0; rounds < 100; ++rounds) {
      if (std::none_of(slots_.begin(), slots_.end(), [](const Slot& s) { return s.under_way; })) {
        break;
      }
      handle_events(std::chrono::milliseconds{10});
    }
    for (Slot& slot : slots_) {
      // A transfer that has not returned is left to libusb, which may still write into it.
      if (slot.transfer != nullptr && !slot.under_way) libusb_free_transfer(slot.transfer);
      slot.transfer = nullptr;
    }
    if (claimed_) static_cast<void>(libusb_release_interface(device_, endpoints_.interface));
    libusb_close(std::exchange(device_, nullptr));
    claimed_ = closing_ = gone_ = stalled_ = false;
    stalls_ = 0;
    received_.clear();
  }

  UsbName name_;
  UsbEndpoints endpoints_;
  std::string node_;  ///< of the device that could not be opened
  libusb_context* context_ = nullptr;
  libusb_device_handle* device_ = nullptr;
  bool claimed_ = false;
  bool closing_ = false;
  bool gone_ = false;
  bool stalled_ = false;
  int stalls_ = 0;
  std::deque<std::uint8_t> received_;
  std::array<Slot, kTransfers> slots_;
};

}  // namespace

Expected<std::unique_ptr<Transport>, SetupError> open_usb_port(const UsbName& name,
                                                               const UsbEndpoints& endpoints) {
  return opened<UsbPort>(name, endpoints);
}

}  // namespace merkel
