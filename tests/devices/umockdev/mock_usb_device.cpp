#include "tests/devices/umockdev/mock_usb_device.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <cstring>
#include <utility>

#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>
#include <unistd.h>

namespace merkel {
namespace {

constexpr unsigned kInterfaces = 2;
constexpr std::size_t kSetupBytes = 8;

// Requests to the control endpoint.
constexpr std::uint8_t kGetDescriptor = 6;
constexpr std::uint8_t kString = 3;
constexpr std::uint8_t kReport = 0x22;

Bytes device_and_configuration(std::size_t report_bytes) {
  return {
      0x12, 0x01, 0x00, 0x02, 0x00, 0x00, 0x00, 0x40,
      0x09, 0x12, 0x01, 0x00, 0x00, 0x01, 0x01, 0x02,
      0x03, 0x01,  // device 1209:0001
      0x09, 0x02, 0x40, 0x00, 0x02, 0x01, 0x00, 0x80,
      0x32,  // configuration
      0x09, 0x04, 0x00, 0x00, 0x03, 0xff, 0x00, 0x00,
      0x00,                                      // interface 0: vendor's
      0x07, 0x05, 0x81, 0x02, 0x00, 0x02, 0x00,  // bulk in
      0x07, 0x05, 0x01, 0x02, 0x00, 0x02, 0x00,  // bulk out
      0x07, 0x05, 0x83, 0x03, 0x40, 0x00, 0x04,  // interrupt in
      0x09, 0x04, 0x01, 0x00, 0x01, 0x03, 0x00, 0x00,
      0x00,  // interface 1: HID
      0x09, 0x21, 0x11, 0x01, 0x00, 0x01, 0x22, static_cast<std::uint8_t>(report_bytes),
      0x00, 0x07, 0x05, 0x82, 0x03, 0x40, 0x00, 0x01,  // interrupt in
  };
}

Bytes string_descriptor(std::string_view text) {
  Bytes bytes = {static_cast<std::uint8_t>(2 + 2 * text.size()), kString};
  for (const char character : text) {
    bytes.push_back(static_cast<std::uint8_t>(character));
    bytes.push_back(0);
  }
  return bytes;
}

}  // namespace

usbdevfs_urb& MockUsbDevice::Transfer::request() const {
  return *reinterpret_cast<usbdevfs_urb*>(urb->data);
}

MockUsbDevice::MockUsbDevice(MockMachine& machine, const std::string& usb_port, int number,
                             std::string serial_number, Bytes report_descriptor)
    : machine_(machine),
      usb_path_("/sys/devices/pci0000:00/usb1/" + usb_port),
      serial_number_(std::move(serial_number)),
      report_descriptor_(std::move(report_descriptor)) {
  std::array<char, 4> digits{};
  std::snprintf(digits.data(), digits.size(), "%03d", number);
  const std::string name = std::string("bus/usb/001/") + digits.data();
  node_ = "/dev/" + name;
  machine_.add(
      "P: /devices/pci0000:00/usb1/" + usb_port + "\nN: " + name +
      "=00\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_device\nE: BUSNUM=001\nE: DEVNUM=" + digits.data() +
      "\nE: DEVNAME=" + node_ + "\nE: MAJOR=189\nE: MINOR=" + std::to_string(number - 1) +
      "\nA: busnum=1\\n\nA: devnum=" + std::to_string(number) +
      "\\n\nA: idVendor=1209\\n\nA: idProduct=0001\\n\nA: bConfigurationValue=1\\n\n"
      "A: speed=480\\n\nA: bDeviceClass=00\\n\nA: product=Force Probe\\n\nA: serial=" +
      serial_number_ + "\\n\nH: descriptors=" +
      hexadecimal(device_and_configuration(report_descriptor_.size())) + "\n\n");
  pipe_ = machine_.make_pipe(node_);
  show_readiness();
  machine_.attach(node_, *this);
  machine_.announce(usb_path_, "add");
}

MockUsbDevice::~MockUsbDevice() {
  unplug();
  machine_.detach(node_);
  ::close(pipe_);
}

void MockUsbDevice::send(std::uint8_t endpoint, std::string_view bytes) {
  const std::scoped_lock lock(mutex_);
  endpoints_[endpoint].packets.emplace_back(bytes);
  move_bytes();
}

void MockUsbDevice::stall(std::uint8_t endpoint, bool again) {
  const std::scoped_lock lock(mutex_);
  endpoints_[endpoint].halted = true;
  endpoints_[endpoint].halted_again = again;
  move_bytes();
}

void MockUsbDevice::fail(std::uint8_t endpoint, int error) {
  const std::scoped_lock lock(mutex_);
  endpoints_[endpoint].error = error;
  move_bytes();
}

void MockUsbDevice::set_busy(bool busy) {
  const std::scoped_lock lock(mutex_);
  busy_ = busy;
}

void MockUsbDevice::unplug() {
  {
    const std::scoped_lock lock(mutex_);
    if (std::exchange(gone_, true)) return;
    for (Transfer& transfer : transfers_) {
      if (!transfer.done) finish(transfer, -ESHUTDOWN, 0);
    }
    show_readiness();
  }
  machine_.unplug(usb_path_);
}

std::string MockUsbDevice::received() {
  const std::scoped_lock lock(mutex_);
  return received_;
}

std::size_t MockUsbDevice::waiting(std::uint8_t endpoint) {
  const std::scoped_lock lock(mutex_);
  return static_cast<std::size_t>(
      std::count_if(transfers_.begin(), transfers_.end(), [&](const Transfer& transfer) {
        return !transfer.done && transfer.request().endpoint == endpoint;
      }));
}

std::size_t MockUsbDevice::left(std::uint8_t endpoint) {
  const std::scoped_lock lock(mutex_);
  return endpoints_[endpoint].packets.size();
}

std::size_t MockUsbDevice::halts_cleared() {
  const std::scoped_lock lock(mutex_);
  return halts_cleared_;
}

bool MockUsbDevice::handle_ioctl(UMockdevIoctlClient* client) {
  const std::scoped_lock lock(mutex_);
  const int error =
      answer(umockdev_ioctl_client_get_request(client), umockdev_ioctl_client_get_arg(client));
  move_bytes();
  umockdev_ioctl_client_complete(client, error == 0 ? 0 : -1, error);
  return true;
}

/// Returns 0 or an errno.
int MockUsbDevice::answer(unsigned long request, UMockdevIoctlData* argument) {
  const auto number = [&]() -> unsigned& {
    auto* const data = umockdev_ioctl_data_resolve(argument, 0, sizeof(unsigned), nullptr);
    return *reinterpret_cast<unsigned*>(data->data);
  };
  switch (request) {
    case USBDEVFS_REAPURB:
    case USBDEVFS_REAPURBNDELAY:
      return reap(argument);
    case USBDEVFS_DISCARDURB:
      return discard(argument);
    default:
      if (gone_) return ENODEV;
  }
  switch (request) {
    case USBDEVFS_GET_CAPABILITIES:
      number() = USBDEVFS_CAP_BULK_CONTINUATION | USBDEVFS_CAP_NO_PACKET_SIZE_LIM;
      return 0;
    case USBDEVFS_CLAIMINTERFACE:
      return number() >= kInterfaces ? ENOENT : (busy_ ? EBUSY : 0);
    case USBDEVFS_RELEASEINTERFACE:
      return 0;
    case USBDEVFS_CLEAR_HALT: {
      Endpoint& endpoint = endpoints_[static_cast<std::uint8_t>(number())];
      endpoint.halted = endpoint.halted_again;
      ++halts_cleared_;
      return 0;
    }
    case USBDEVFS_GETDRIVER:
    case USBDEVFS_IOCTL:
      return ENODATA;  // no kernel driver is attached
    case USBDEVFS_SUBMITURB:
      return submit(argument);
    default:
      return ENOTTY;
  }
}

int MockUsbDevice::submit(UMockdevIoctlData* argument) {
  UMockdevIoctlData* const urb =
      umockdev_ioctl_data_resolve(argument, 0, sizeof(usbdevfs_urb), nullptr);
  Transfer transfer{.urb = umockdev_ioctl_data_ref(urb)};
  usbdevfs_urb& request = transfer.request();
  transfer.buffer = umockdev_ioctl_data_resolve(urb, offsetof(usbdevfs_urb, buffer),
                                                static_cast<gsize>(request.buffer_length), nullptr);
  if (transfer.buffer != nullptr) umockdev_ioctl_data_ref(transfer.buffer);
  if (request.type == USBDEVFS_URB_TYPE_CONTROL) {
    control(transfer);
    transfer.done = true;
  } else if (request.endpoint == kBulkOut) {
    const auto length = static_cast<std::size_t>(request.buffer_length);
    Endpoint& endpoint = endpoints_[kBulkOut];
    if (endpoint.halted) {
      finish(transfer, -EPIPE, 0);
    } else {
      received_.append(reinterpret_cast<const char*>(transfer.buffer->data), length);
      finish(transfer, 0, length);
    }
  }
  transfers_.push_back(transfer);
  return 0;
}

int MockUsbDevice::discard(UMockdevIoctlData* argument) {
  const unsigned long wanted = *reinterpret_cast<unsigned long*>(argument->data);
  for (Transfer& transfer : transfers_) {
    if (transfer.done || transfer.urb->client_addr != wanted) continue;
    finish(transfer, -ENOENT, 0);
    return 0;
  }
  return EINVAL;
}

int MockUsbDevice::reap(UMockdevIoctlData* argument) {
  const auto first = std::find_if(transfers_.begin(), transfers_.end(),
                                  [](const Transfer& transfer) { return transfer.done; });
  if (first == transfers_.end()) return gone_ ? ENODEV : EAGAIN;
  UMockdevIoctlData* const place = umockdev_ioctl_data_resolve(argument, 0, sizeof(void*), nullptr);
  umockdev_ioctl_data_set_ptr(place, 0, first->urb);
  transfers_.erase(first);
  return 0;
}

void MockUsbDevice::control(const Transfer& transfer) const {
  unsigned char* const setup = transfer.buffer->data;
  usbdevfs_urb& request = transfer.request();
  const std::size_t wanted = setup[6] | static_cast<std::size_t>(setup[7]) << 8U;
  const bool in = (setup[0] & 0x80U) != 0U;
  Bytes answer;
  if (in && setup[1] == kGetDescriptor && setup[3] == kString) {
    const std::array<std::string, 4> texts = {"", "Haptics Lab", "Force Probe", serial_number_};
    answer = setup[2] == 0 ? Bytes{4, kString, 9, 4} : string_descriptor(texts.at(setup[2] & 3U));
  } else if (in && setup[1] == kGetDescriptor && setup[3] == kReport) {
    answer = report_descriptor_;
  } else if (in) {
    request.status = -EPIPE;
    return;
  }
  answer.resize(std::min(answer.size(), wanted));
  std::copy(answer.begin(), answer.end(), setup + kSetupBytes);
  request.status = 0;
  request.actual_length = static_cast<int>(in ? answer.size() : wanted);
}

/// Moves packets to the waiting transfers, both in order.
void MockUsbDevice::move_bytes() {
  for (Transfer& transfer : transfers_) {
    if (transfer.done) continue;
    usbdevfs_urb& request = transfer.request();
    Endpoint& endpoint = endpoints_[request.endpoint];
    if (endpoint.halted) {
      finish(transfer, -EPIPE, 0);
    } else if (endpoint.error != 0) {
      finish(transfer, std::exchange(endpoint.error, 0), 0);
    } else if (!endpoint.packets.empty()) {
      std::string& packet = endpoint.packets.front();
      const std::size_t length =
          std::min(packet.size(), static_cast<std::size_t>(request.buffer_length));
      std::memcpy(transfer.buffer->data, packet.data(), length);
      endpoint.packets.pop_front();
      finish(transfer, 0, length);
    }
  }
  show_readiness();
}

void MockUsbDevice::finish(Transfer& transfer, int status, std::size_t length) {
  usbdevfs_urb& request = transfer.request();
  request.status = status;
  request.actual_length = static_cast<int>(length);
  transfer.done = true;
}

/// usbfs signals a finished transfer by POLLOUT; a pipe signals it while it is not full.
void MockUsbDevice::show_readiness() {
  std::array<char, 4096> page{};
  const bool ready = gone_ || std::any_of(transfers_.begin(), transfers_.end(),
                                          [](const Transfer& transfer) { return transfer.done; });
  if (ready) {
    while (::read(pipe_, page.data(), page.size()) > 0) {
    }
  } else {
    while (::write(pipe_, page.data(), page.size()) > 0) {
    }
  }
}

}  // namespace merkel
