#include "tests/devices/umockdev/mock_serial_adapter.hpp"

#include <cstring>
#include <utility>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <libserialport.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

namespace merkel {
namespace {

constexpr int kAllLines = TIOCM_DTR | TIOCM_RTS | TIOCM_CTS | TIOCM_CAR | TIOCM_DSR;

}  // namespace

MockSerialAdapter::MockSerialAdapter(MockMachine& machine, const std::string& name,
                                     const std::string& usb_port, const std::string& serial_number)
    : machine_(machine),
      node_("/dev/" + name),
      usb_path_("/sys/devices/pci0000:00/usb1/" + usb_port),
      modem_lines_(kAllLines) {
  settings_.type = PORT_16550A;
  settings_.baud_base = 24'000'000;
  const std::string usb = "/devices/pci0000:00/usb1/" + usb_port;
  const std::string interface = usb + "/" + usb_port + ":1.0";
  const std::string minor = machine_.fresh_number();
  machine_.add(
      "P: " + usb + "\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_device\nA: busnum=1\\n\nA: devnum=" + "1" +
      minor + "\\n\nA: idVendor=0403\\n\nA: idProduct=6001\\n\nA: serial=" + serial_number +
      "\\n\nA: product=FT232R USB UART\\n\nA: manufacturer=FTDI\\n\n\n" + "P: " + interface +
      "\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_interface\nA: bInterfaceNumber=00\\n\n\n" +
      "P: " + interface + "/" + name + "\nE: SUBSYSTEM=usb-serial\nA: latency_timer=16\\n\n\n" +  //
      "P: " + interface + "/" + name + "/tty/" + name + "\nN: " + name +
      "\nE: SUBSYSTEM=tty\nE: DEVNAME=" + node_ + "\nE: MAJOR=188\nE: MINOR=" + minor +
      "\nA: dev=188:" + minor + "\\n\nL: device=../../../" + name + "\n\n");
  machine_.attach(node_, *this);
  terminal_ = machine_.terminal_of(node_);
  // A child that inherits it would keep the terminal from hanging up.
  ::fcntl(terminal_, F_SETFD, FD_CLOEXEC);
}

std::string MockSerialAdapter::obstacle() {
  static const bool crashes = [] {
    MockMachine machine;
    const MockSerialAdapter adapter(machine, "ttyUSB0", "1-1", "A1B2C3");
    const pid_t child = ::fork();
    if (child == 0) {
      sp_port* port = nullptr;
      static_cast<void>(sp_get_port_by_name("/dev/ttyUSB0", &port));
      ::_exit(0);
    }
    int status = 0;
    return child > 0 && ::waitpid(child, &status, 0) == child && WIFSIGNALED(status);
  }();
  return crashes ? "this libserialport crashes in this version of umockdev" : "";
}

void MockSerialAdapter::send(std::string_view text) const {
  EXPECT_EQ(::write(terminal_, text.data(), text.size()), static_cast<ssize_t>(text.size()));
}

void MockSerialAdapter::unplug() {
  if (terminal_ < 0) return;
  ::close(std::exchange(terminal_, -1));
  machine_.detach(node_);
  machine_.unplug(usb_path_);
}

bool MockSerialAdapter::handle_ioctl(UMockdevIoctlClient* client) {
  UMockdevIoctlData* const argument = umockdev_ioctl_client_get_arg(client);
  const auto answer = [&](const auto& value) {
    auto* const data = umockdev_ioctl_data_resolve(argument, 0, sizeof value, nullptr);
    std::memcpy(data->data, &value, sizeof value);
  };
  const auto take = [&](auto& value) {
    auto* const data = umockdev_ioctl_data_resolve(argument, 0, sizeof value, nullptr);
    std::memcpy(&value, data->data, sizeof value);
  };
  int bits = 0;
  switch (umockdev_ioctl_client_get_request(client)) {
    case TIOCMGET:
      answer(modem_lines_);
      break;
    case TIOCMSET:
      take(modem_lines_);
      break;
    case TIOCMBIS:
      take(bits);
      modem_lines_ |= bits;
      break;
    case TIOCMBIC:
      take(bits);
      modem_lines_ &= ~bits;
      break;
    case TIOCGSERIAL:
      answer(settings_);
      break;
    case TIOCSSERIAL:
      take(settings_);
      break;
    default: {
      // All other calls go to the pseudo-terminal.
      int error = 0;
      const int result = umockdev_ioctl_client_execute(client, &error, nullptr);
      umockdev_ioctl_client_complete(client, result, result < 0 ? error : 0);
      return true;
    }
  }
  umockdev_ioctl_client_complete(client, 0, 0);
  return true;
}

}  // namespace merkel
