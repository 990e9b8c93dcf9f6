// Linked into a test program, this gives pseudo-terminals what only real serial ports have: modem
// lines and adapter settings. With it, libserialport can be tested on a pty.

#include <cstdarg>
#include <cstring>

#include <asm/ioctls.h>
#include <linux/serial.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/sysmacros.h>
#include <unistd.h>

namespace {

constexpr int kAllLines = 0x2 | 0x4 | 0x20 | 0x40 | 0x100;

bool is_pty(int descriptor) {
  struct stat status {};
  return ::fstat(descriptor, &status) == 0 && S_ISCHR(status.st_mode) &&
         major(status.st_rdev) >= 136 && major(status.st_rdev) <= 143;
}

}  // namespace

extern "C" int ioctl(int descriptor, unsigned long request, ...) noexcept {
  static int lines = kAllLines;
  static serial_struct settings{};
  std::va_list arguments;
  va_start(arguments, request);
  void* const argument = va_arg(arguments, void*);
  va_end(arguments);
  const auto pass_on = [&](unsigned long call, void* value) {
    return static_cast<int>(::syscall(SYS_ioctl, descriptor, call, value));
  };
  switch (request) {
    case TIOCMGET:
    case TIOCMSET:
    case TIOCMBIS:
    case TIOCMBIC:
    case TIOCGSERIAL:
    case TIOCSSERIAL:
      break;
    default:
      return pass_on(request, argument);
  }
  if (!is_pty(descriptor)) return pass_on(request, argument);
  int waiting = 0;
  if (pass_on(TIOCINQ, &waiting) < 0) return -1;  // hung up: an error, as of a real port
  if (request == TIOCGSERIAL) {
    std::memcpy(argument, &settings, sizeof settings);
  } else if (request == TIOCSSERIAL) {
    std::memcpy(&settings, argument, sizeof settings);
  } else {
    int& value = *static_cast<int*>(argument);
    if (request == TIOCMGET) value = lines;
    if (request == TIOCMSET) lines = value;
    if (request == TIOCMBIS) lines |= value;
    if (request == TIOCMBIC) lines &= ~value;
  }
  return 0;
}
