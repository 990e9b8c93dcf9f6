#include "drivers/transports/serial_port.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <utility>

#include <libserialport.h>
#include <linux/serial.h>
#include <sys/ioctl.h>
#include <sys/stat.h>

#include "drivers/transports/descriptor.hpp"
#include "drivers/transports/pty_port.hpp"

namespace merkel {
namespace {

struct FreePort {
  void operator()(sp_port* port) const noexcept { sp_free_port(port); }
};
using Port = std::unique_ptr<sp_port, FreePort>;

std::string text_of(const char* text) { return text == nullptr ? "" : text; }

SerialPortInfo describe(const sp_port* port) {
  SerialPortInfo info{.device = text_of(sp_get_port_name(port)),
                      .description = text_of(sp_get_port_description(port)),
                      .serial_number = text_of(sp_get_port_usb_serial(port))};
  int vendor = -1;
  int product = -1;
  if (sp_get_port_usb_vid_pid(port, &vendor, &product) == SP_OK) {
    info.vendor = vendor;
    info.product = product;
  }
  return info;
}

/// Requests a USB adapter not to hold bytes back. \return the result, as text. FTDI chips wait for
/// 16 ms by default, which makes batches; other adapters accept the flag and ignore it.
std::string lower_latency(int descriptor, const std::string& device) {
  serial_struct settings{};
  if (::ioctl(descriptor, TIOCGSERIAL, &settings) != 0) return "no low-latency flag";
  settings.flags |= static_cast<int>(ASYNC_LOW_LATENCY);
  const bool set = ::ioctl(descriptor, TIOCSSERIAL, &settings) == 0 &&
                   ::ioctl(descriptor, TIOCGSERIAL, &settings) == 0 &&
                   (settings.flags & static_cast<int>(ASYNC_LOW_LATENCY)) != 0;
  std::string note = set ? "low-latency flag set" : "low-latency flag refused";
  const auto slash = device.rfind('/');
  std::ifstream timer("/sys/bus/usb-serial/devices/" + device.substr(slash + 1) + "/latency_timer");
  if (int latency_ms = 0; timer >> latency_ms) {
    note += ", latency timer " + std::to_string(latency_ms) + " ms";
  }
  return note;
}

class SerialPort final : public Transport {
 public:
  explicit SerialPort(const SerialSettings& settings) : settings_(settings) {
    info_.name = settings.device;
  }
  ~SerialPort() override { close(); }

  [[nodiscard]] Expected<std::size_t, Disconnected> read(
      std::span<std::uint8_t> bytes, std::chrono::nanoseconds patience) override {
    // Wait here, because libserialport's own waits never end after an unplug.
    using Result = Expected<std::size_t, Disconnected>;
    return read_when_ready(descriptor_, patience, [&]() -> Result {
      const int count = sp_nonblocking_read(port_.get(), bytes.data(), bytes.size());
      // Readable but without data: unplugged.
      if (count <= 0) return Unexpected<Disconnected>(Disconnected{});
      return static_cast<std::size_t>(count);
    });
  }

  [[nodiscard]] Expected<void, Disconnected> write(std::span<const std::uint8_t> bytes) override {
    while (!bytes.empty()) {
      const int count = sp_nonblocking_write(port_.get(), bytes.data(), bytes.size());
      if (count < 0) return Unexpected<Disconnected>(Disconnected{});
      bytes = bytes.subspan(static_cast<std::size_t>(count));
      if (count == 0 && wait_writable(descriptor_, std::chrono::seconds{1}) != Readiness::kReady) {
        return Unexpected<Disconnected>(Disconnected{});
      }
    }
    return {};
  }

  [[nodiscard]] Expected<void, SetupError> reopen() override {
    close();
    const std::string device = whereabouts();
    if (device.empty()) return Unexpected<SetupError>(port_error(settings_.device, ENODEV));
    struct stat status {};
    if (::stat(device.c_str(), &status) != 0) {
      return Unexpected<SetupError>(port_error(device, errno));
    }
    sp_port* found = nullptr;
    if (sp_get_port_by_name(device.c_str(), &found) != SP_OK) {
      return Unexpected<SetupError>(
          SetupError{.kind = SetupError::Kind::kBadInput,
                     .sentence = device + " is not a serial port; merkel probes lists the ports"});
    }
    port_.reset(found);
    errno = 0;
    if (sp_open(port_.get(), SP_MODE_READ_WRITE) != SP_OK) {
      const int error_number = errno != 0 ? errno : ENOTTY;
      port_.reset();
      return Unexpected<SetupError>(port_error(device, error_number));
    }
    open_ = true;
    if (sp_get_port_handle(port_.get(), &descriptor_) != SP_OK || !lock_port(descriptor_)) {
      close();
      return Unexpected<SetupError>(port_busy(device));
    }
    if (sp_set_baudrate(port_.get(), settings_.baud) != SP_OK ||
        sp_set_bits(port_.get(), 8) != SP_OK ||
        sp_set_parity(port_.get(), SP_PARITY_NONE) != SP_OK ||
        sp_set_stopbits(port_.get(), 1) != SP_OK ||
        sp_set_flowcontrol(port_.get(), SP_FLOWCONTROL_NONE) != SP_OK) {
      close();
      return Unexpected<SetupError>(
          SetupError{.kind = SetupError::Kind::kBadInput,
                     .sentence = device + " does not support " + std::to_string(settings_.baud) +
                                 " Bd: use a rate that its adapter supports, such as baud=115200"});
    }
    // The terminal echoes between opening and configuring; earlier input is discarded.
    static_cast<void>(sp_flush(port_.get(), SP_BUF_BOTH));
    const SerialPortInfo info = describe(port_.get());
    vendor_ = info.vendor;
    product_ = info.product;
    info_.serial_number = info.serial_number;
    info_.note = lower_latency(descriptor_, device);
    return {};
  }

 private:
  /// The present name of the device; empty if unplugged. Another device may have received its old
  /// name.
  [[nodiscard]] std::string whereabouts() const {
    if (vendor_ < 0 || info_.serial_number.empty()) return settings_.device;
    for (const SerialPortInfo& port : list_serial_ports()) {
      if (port.vendor == vendor_ && port.product == product_ &&
          port.serial_number == info_.serial_number) {
        return port.device;
      }
    }
    return {};
  }

  void close() noexcept {
    if (open_) sp_close(port_.get());
    open_ = false;
    port_.reset();
    descriptor_ = -1;
  }

  SerialSettings settings_;
  Port port_;
  bool open_ = false;
  int descriptor_ = -1;
  int vendor_ = -1;
  int product_ = -1;
};

}  // namespace

Expected<std::unique_ptr<Transport>, SetupError> open_serial_port(const SerialSettings& settings) {
  return opened<SerialPort>(settings);
}

Expected<std::unique_ptr<Transport>, SetupError> open_serial(const SerialSettings& settings) {
  return is_pty(settings.device) ? open_pty_port(settings) : open_serial_port(settings);
}

std::vector<SerialPortInfo> list_serial_ports() {
  std::vector<SerialPortInfo> infos;
  sp_port** ports = nullptr;
  if (sp_list_ports(&ports) != SP_OK) return infos;
  for (sp_port** port = ports; *port != nullptr; ++port) infos.push_back(describe(*port));
  sp_free_port_list(ports);
  return infos;
}

}  // namespace merkel
