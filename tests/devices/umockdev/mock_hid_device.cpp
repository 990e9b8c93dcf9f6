#include "tests/devices/umockdev/mock_hid_device.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include <linux/hidraw.h>
#include <linux/input.h>
#include <unistd.h>

namespace merkel {
namespace {

constexpr short kVendor = 0x16c0;
constexpr short kProduct = 0x0486;

}  // namespace

MockHidDevice::MockHidDevice(MockMachine& machine, const std::string& name,
                             const std::string& usb_port, const std::string& serial_number,
                             const Bytes& descriptor)
    : machine_(machine),
      node_("/dev/" + name),
      usb_path_("/sys/devices/pci0000:00/usb1/" + usb_port),
      descriptor_(descriptor) {
  const std::string usb = "/devices/pci0000:00/usb1/" + usb_port;
  const std::string interface = usb + "/" + usb_port + ":1.0";
  const std::string minor = machine_.fresh_number();
  const std::string hid = interface + "/0003:16C0:0486.000" + minor;
  machine_.add(
      "P: " + usb + "\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_device\nA: busnum=1\\n\nA: devnum=2" +
      minor + "\\n\nA: idVendor=16c0\\n\nA: idProduct=0486\\n\nA: serial=" + serial_number +
      "\\n\nA: product=RawHID\\n\nA: manufacturer=PJRC\\n\nA: bcdDevice=0100\\n\n\n" + "P: " +
      interface + "\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_interface\nA: bInterfaceNumber=00\\n\n\n" +
      "P: " + hid + "\nE: SUBSYSTEM=hid\nE: HID_ID=0003:000016C0:00000486\n" +
      "E: HID_NAME=PJRC RawHID\nE: HID_UNIQ=" + serial_number +
      "\nE: HID_PHYS=usb-0/input0\nH: report_descriptor=" + hexadecimal(descriptor) + "\n\n" +
      "P: " + hid + "/hidraw/" + name + "\nN: " + name +
      "=00\nE: SUBSYSTEM=hidraw\nE: DEVNAME=" + node_ + "\nE: MAJOR=245\nE: MINOR=" + minor +
      "\nL: device=../../../0003:16C0:0486.000" + minor + "\n\n");
  pipe_ = machine_.make_pipe(node_);
  machine_.attach(node_, *this);
}

MockHidDevice::~MockHidDevice() {
  unplug();
  machine_.detach(node_);
}

void MockHidDevice::send(const Bytes& report) const {
  static_cast<void>(!::write(pipe_, report.data(), report.size()));
}

void MockHidDevice::unplug() {
  if (pipe_ < 0) return;
  gone_ = true;
  // Wakes up a waiting reader, whose next read fails.
  static_cast<void>(!::write(pipe_, "", 1));
  machine_.unplug(usb_path_);
  ::close(std::exchange(pipe_, -1));
}

bool MockHidDevice::handle_ioctl(UMockdevIoctlClient* client) {
  UMockdevIoctlData* const argument = umockdev_ioctl_client_get_arg(client);
  const auto answer = [&](const auto& value) {
    auto* const data = umockdev_ioctl_data_resolve(argument, 0, sizeof value, nullptr);
    std::memcpy(data->data, &value, sizeof value);
    umockdev_ioctl_client_complete(client, 0, 0);
  };
  if (gone_) {
    umockdev_ioctl_client_complete(client, -1, ENODEV);
    return true;
  }
  switch (umockdev_ioctl_client_get_request(client)) {
    case HIDIOCGRDESCSIZE:
      answer(static_cast<int>(descriptor_.size()));
      break;
    case HIDIOCGRDESC: {
      hidraw_report_descriptor descriptor{};
      descriptor.size = static_cast<std::uint32_t>(descriptor_.size());
      std::copy(descriptor_.begin(), descriptor_.end(), descriptor.value);
      answer(descriptor);
      break;
    }
    case HIDIOCGRAWINFO:
      answer(hidraw_devinfo{.bustype = BUS_USB, .vendor = kVendor, .product = kProduct});
      break;
    default:
      umockdev_ioctl_client_complete(client, -1, ENOTTY);
  }
  return true;
}

bool MockHidDevice::handle_read(UMockdevIoctlClient* client) {
  if (!gone_) return false;
  umockdev_ioctl_client_complete(client, -1, ENODEV);
  return true;
}

bool MockHidDevice::handle_write(UMockdevIoctlClient* client) {
  const auto length = umockdev_ioctl_client_get_arg(client)->data_len;
  umockdev_ioctl_client_complete(client, gone_ ? -1 : static_cast<long>(length),
                                 gone_ ? ENODEV : 0);
  return true;
}

}  // namespace merkel
