#include "drivers/simulation/pty_master.hpp"

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <utility>

#include <asm/termbits.h>
#include <fcntl.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "drivers/transports/descriptor.hpp"

namespace merkel {
namespace {

constexpr unsigned kNobodysBaud = 50;  ///< initial rate, which no device uses

/// The target of a symbolic link; empty if the path is not a link.
std::string target_of(const std::string& link) {
  std::array<char, 256> target{};
  const auto length = ::readlink(link.c_str(), target.data(), target.size());
  return length > 0 ? std::string(target.data(), static_cast<std::size_t>(length)) : std::string();
}

/// True if the name is free or a link to a terminal, left by an earlier simulation.
bool is_terminal_link(const std::string& name) {
  struct stat status {};
  if (::lstat(name.c_str(), &status) != 0) return errno == ENOENT || errno == ENOTDIR;
  return target_of(name).starts_with("/dev/pts/");
}

}  // namespace

Expected<void, SetupError> PtyMaster::plug_in() {
  const std::string& link = wanted_link_;
  unplug();
  master_ = ::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (master_ < 0 || ::grantpt(master_) != 0 || ::unlockpt(master_) != 0) {
    return unavailable(std::string("cannot make a pseudo-terminal: ") + std::strerror(errno) +
                       "; mount the file system devpts at /dev/pts (in a container, as its runtime "
                       "does by default), or allow more of them (sysctl kernel.pty.max)");
  }
  char terminal[64];
  if (::ptsname_r(master_, terminal, sizeof terminal) != 0) {
    return unavailable(std::string("cannot name the pseudo-terminal: ") + std::strerror(errno));
  }
  slave_ = ::open(terminal, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  termios2 settings{};
  if (slave_ < 0 || ::ioctl(slave_, TCGETS2, &settings) != 0) {
    return unavailable(std::string("cannot open the pseudo-terminal: ") + std::strerror(errno));
  }
  settings.c_iflag = settings.c_oflag = settings.c_lflag = 0;
  settings.c_cflag = CS8 | CREAD | CLOCAL | BOTHER;
  settings.c_ispeed = settings.c_ospeed = kNobodysBaud;
  static_cast<void>(::ioctl(slave_, TCSETS2, &settings));
  name_ = terminal;
  if (link.empty()) return {};
  return make_link(link);
}

Expected<void, SetupError> PtyMaster::make_link(const std::string& link) {
  if (!is_terminal_link(link)) {
    return bad_input("cannot make the link " + link +
                     ": a file of that name exists and is not a simulated probe's; give another "
                     "name");
  }
  // Created next to its final name, then renamed, so that the link never vanishes.
  const std::string fresh = link + ".new-" + std::to_string(::getpid());
  if (::symlink(name_.c_str(), fresh.c_str()) != 0) {
    return bad_input("cannot make the link " + fresh + ": " + std::strerror(errno));
  }
  if (::rename(fresh.c_str(), link.c_str()) != 0) {
    const int error = errno;
    ::unlink(fresh.c_str());
    return bad_input("cannot make the link " + link + ": " + std::strerror(error));
  }
  target_ = name_;
  name_ = link_ = link;
  return {};
}

void PtyMaster::unplug() noexcept {
  // Another program may have created its own file there.
  if (!link_.empty() && target_of(link_) == target_) ::unlink(link_.c_str());
  link_.clear();
  if (slave_ >= 0) ::close(std::exchange(slave_, -1));
  if (master_ >= 0) ::close(std::exchange(master_, -1));
}

int PtyMaster::baud() const noexcept {
  termios2 settings{};
  if (master_ < 0 || ::ioctl(master_, TCGETS2, &settings) != 0) return 0;
  return settings.c_ospeed == kNobodysBaud ? 0 : static_cast<int>(settings.c_ospeed);
}

std::size_t PtyMaster::read(std::span<std::uint8_t> bytes,
                            std::chrono::nanoseconds patience) noexcept {
  if (master_ < 0 || wait_readable(master_, patience) != Readiness::kReady) return 0;
  const auto count = ::read(master_, bytes.data(), bytes.size());
  return count > 0 ? static_cast<std::size_t>(count) : 0;
}

std::size_t PtyMaster::write(std::span<const std::uint8_t> bytes) noexcept {
  if (master_ < 0) return 0;
  const auto count = ::write(master_, bytes.data(), bytes.size());
  return count > 0 ? static_cast<std::size_t>(count) : 0;
}

}  // namespace merkel
