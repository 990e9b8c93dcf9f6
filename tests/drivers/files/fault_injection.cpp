#include "tests/drivers/files/fault_injection.hpp"

#include <atomic>
#include <cerrno>
#include <cstdio>

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace merkel {
namespace {

std::atomic<int> g_calls_left{-1};  ///< negative: no fault
std::atomic<int> g_error{0};
std::atomic<bool> g_happened{false};

bool fails(bool changes_data) {
  if (g_error == 0) return false;
  if (g_happened) {
    errno = g_error;
    return changes_data;
  }
  if (g_calls_left.fetch_sub(1) > 0) return false;
  g_happened = true;
  errno = g_error;
  return true;
}

bool is_regular(int descriptor) {
  struct stat status {};
  return ::fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode);
}

}  // namespace

FaultInjection::FaultInjection(int call, int error) {
  g_happened = false;
  g_calls_left = call;
  g_error = error;
}

FaultInjection::~FaultInjection() { g_error = 0; }

bool FaultInjection::happened() { return g_happened; }

}  // namespace merkel

// These replace the C library's functions in the whole program, including its libraries.
extern "C" {

ssize_t write(int descriptor, const void* bytes, size_t count) {
  if (merkel::is_regular(descriptor) && merkel::fails(true)) return -1;
  return ::syscall(SYS_write, descriptor, bytes, count);
}

ssize_t pwrite(int descriptor, const void* bytes, size_t count, off_t place) {
  if (merkel::is_regular(descriptor) && merkel::fails(true)) return -1;
  return ::syscall(SYS_pwrite64, descriptor, bytes, count, place);
}

ssize_t pwrite64(int descriptor, const void* bytes, size_t count, off_t place) {
  return ::pwrite(descriptor, bytes, count, place);
}

int ftruncate(int descriptor, off_t length) noexcept {
  if (merkel::fails(false)) return -1;
  return static_cast<int>(::syscall(SYS_ftruncate, descriptor, length));
}

int ftruncate64(int descriptor, off_t length) noexcept { return ::ftruncate(descriptor, length); }

int fsync(int descriptor) {
  if (merkel::fails(false)) return -1;
  return static_cast<int>(::syscall(SYS_fsync, descriptor));
}

int renameat2(int from_folder, const char* from, int to_folder, const char* to,
              unsigned flags) noexcept {
  if (merkel::fails(false)) return -1;
  return static_cast<int>(::syscall(SYS_renameat2, from_folder, from, to_folder, to, flags));
}
}
