#include "drivers/transports/descriptor.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>

#include <fcntl.h>
#include <grp.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace merkel {
namespace {

constexpr std::chrono::seconds kWritePatience{1};

Readiness wait_for(int descriptor, short events, std::chrono::nanoseconds patience) noexcept {
  constexpr long kPerSecond = 1'000'000'000;
  pollfd watched{.fd = descriptor, .events = events, .revents = 0};
  const auto count = std::max<std::int64_t>(patience.count(), 0);
  timespec timeout{};
  timeout.tv_sec = static_cast<std::time_t>(count / kPerSecond);
  timeout.tv_nsec = static_cast<long>(count % kPerSecond);
  const int ready = ::ppoll(&watched, 1, &timeout, nullptr);
  if (ready < 0) return errno == EINTR ? Readiness::kTimeout : Readiness::kGone;
  if (ready == 0) return Readiness::kTimeout;
  // Bytes from before the hang-up can still be read.
  if ((watched.revents & events) != 0) return Readiness::kReady;
  return Readiness::kGone;
}

/// The group that may open a port; empty if only root may.
std::string group_of(const std::string& port) {
  struct stat status {};
  if (::stat(port.c_str(), &status) != 0 || status.st_gid == 0) return {};
  const group* const owner = ::getgrgid(status.st_gid);
  return owner == nullptr ? "" : owner->gr_name;
}

}  // namespace

Readiness wait_readable(int descriptor, std::chrono::nanoseconds patience) noexcept {
  return wait_for(descriptor, POLLIN, patience);
}

Readiness wait_writable(int descriptor, std::chrono::nanoseconds patience) noexcept {
  return wait_for(descriptor, POLLOUT, patience);
}

Expected<std::size_t, Disconnected> read_some(int descriptor, std::span<std::uint8_t> bytes,
                                              std::chrono::nanoseconds patience) noexcept {
  using Result = Expected<std::size_t, Disconnected>;
  return read_when_ready(descriptor, patience, [&]() noexcept -> Result {
    const auto count = ::read(descriptor, bytes.data(), bytes.size());
    if (count > 0) return static_cast<std::size_t>(count);
    if (count < 0 && (errno == EAGAIN || errno == EINTR)) return std::size_t{0};
    return Unexpected<Disconnected>(Disconnected{});
  });
}

bool write_all(int descriptor, std::span<const std::uint8_t> bytes) noexcept {
  while (!bytes.empty()) {
    const auto wrote = ::write(descriptor, bytes.data(), bytes.size());
    if (wrote > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(wrote));
    } else if (wrote < 0 && errno != EAGAIN && errno != EINTR) {
      return false;
    } else if (wait_writable(descriptor, kWritePatience) != Readiness::kReady) {
      return false;
    }
  }
  return true;
}

bool lock_port(int descriptor) noexcept { return ::flock(descriptor, LOCK_EX | LOCK_NB) == 0; }

SetupError port_error(const std::string& port, int error_number) {
  SetupError error{.kind = SetupError::Kind::kUnavailable, .sentence = {}};
  switch (error_number) {
    case EBUSY:
      return port_busy(port);
    case EACCES:
    case EPERM: {
      const std::string group = group_of(port);
      if (port.starts_with("/dev/comedi")) {
        error.sentence = "no permission to open " + port + ": " +
                         (group.empty() ? "install libcomedi0, whose udev rule gives it to the "
                                          "group iocard, then load its driver again, and join "
                                          "the group (sudo usermod -aG iocard $USER, then log in "
                                          "again)"
                                        : "join its group (sudo usermod -aG " + group +
                                              " $USER, then log in again)");
        return error;
      }
      error.sentence =
          "no permission to open " + port + ": " +
          (group.empty()
               ? ""
               : "join its group (sudo usermod -aG " + group + " $USER, then log in again) or ") +
          "install the udev rules (sudo cmake --install build/release) after adding its vendor "
          "number to 70-merkel.rules, then plug it in again";
      return error;
    }
    case ENOENT:
    case ENODEV:
    case ENXIO:
      error.sentence = "there is no device " + port +
                       ": plug it in and switch it on; merkel probes lists the devices";
      return error;
    default:
      error.sentence = "cannot open " + port + ": " + std::strerror(error_number) +
                       "; merkel probes lists the devices that can be opened";
      return error;
  }
}

SetupError port_busy(const std::string& port) {
  return {.kind = SetupError::Kind::kUnavailable,
          .sentence = port + " is in use by another program: close that program first (fuser -v " +
                      port + " shows it)"};
}

}  // namespace merkel
