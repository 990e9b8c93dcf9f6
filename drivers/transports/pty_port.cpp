#include "drivers/transports/pty_port.hpp"

#include <cerrno>
#include <utility>

#include <asm/termbits.h>
#include <fcntl.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include "drivers/files/owned_descriptor.hpp"
#include "drivers/transports/descriptor.hpp"

namespace merkel {
namespace {

constexpr unsigned kFirstPtyMajor = 136;
constexpr unsigned kLastPtyMajor = 143;

/// Sets raw mode and a baud rate. False with errno.
bool configure(int descriptor, int baud) {
  termios2 settings{};
  if (::ioctl(descriptor, TCGETS2, &settings) != 0) return false;
  settings.c_iflag = 0;
  settings.c_oflag = 0;
  settings.c_lflag = 0;
  settings.c_cflag = CS8 | CREAD | CLOCAL | BOTHER;
  settings.c_ispeed = settings.c_ospeed = static_cast<speed_t>(baud);
  settings.c_cc[VMIN] = 1;
  settings.c_cc[VTIME] = 0;
  if (::ioctl(descriptor, TCSETS2, &settings) != 0) return false;
  return ::ioctl(descriptor, TCFLSH, TCIOFLUSH) == 0;
}

class PtyPort final : public Transport {
 public:
  explicit PtyPort(const SerialSettings& settings) : settings_(settings) {
    info_.name = settings.device;
    info_.note = "a pseudo-terminal, opened by termios";
  }
  [[nodiscard]] Expected<std::size_t, Disconnected> read(
      std::span<std::uint8_t> bytes, std::chrono::nanoseconds patience) override {
    return read_some(port_.get(), bytes, patience);
  }

  [[nodiscard]] Expected<void, Disconnected> write(std::span<const std::uint8_t> bytes) override {
    if (!write_all(port_.get(), bytes)) return Unexpected<Disconnected>(Disconnected{});
    return {};
  }

  [[nodiscard]] Expected<void, SetupError> reopen() override {
    port_.reset();
    port_.reset(::open(settings_.device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
    if (port_.get() < 0) return Unexpected<SetupError>(port_error(settings_.device, errno));
    if (!lock_port(port_.get())) {
      port_.reset();
      return Unexpected<SetupError>(port_busy(settings_.device));
    }
    if (!configure(port_.get(), settings_.baud)) {
      const int error_number = errno;
      port_.reset();
      return Unexpected<SetupError>(port_error(settings_.device, error_number));
    }
    return {};
  }

 private:
  SerialSettings settings_;
  OwnedDescriptor port_;
};

}  // namespace

bool is_pty(const std::string& device) {
  struct stat status {};
  if (::stat(device.c_str(), &status) != 0 || !S_ISCHR(status.st_mode)) return false;
  const unsigned number = major(status.st_rdev);
  return number >= kFirstPtyMajor && number <= kLastPtyMajor;
}

Expected<std::unique_ptr<Transport>, SetupError> open_pty_port(const SerialSettings& settings) {
  return opened<PtyPort>(settings);
}

}  // namespace merkel
