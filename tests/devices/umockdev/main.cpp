// umockdev's library must be the first in the process: the program restarts itself with it.

#include <cstdio>
#include <cstdlib>
#include <string>

#include <gtest/gtest.h>
#include <umockdev.h>
#include <unistd.h>

namespace {

constexpr const char* kStarted = "MERKEL_UMOCKDEV_STARTED";

/// True if the mock machine has replaced the real one.
bool can_mock() {
  UMockdevTestbed* const testbed = umockdev_testbed_new();
  const bool mocked = umockdev_in_mock_environment() == TRUE;
  g_object_unref(testbed);
  return mocked;
}

}  // namespace

int main(int argc, char** argv) {
  if (std::getenv(kStarted) == nullptr) {
    const char* const asan = std::getenv("ASAN_OPTIONS");
    const std::string options =
        std::string(asan == nullptr ? "" : asan) + ":verify_asan_link_order=0";
    ::setenv(kStarted, "1", 1);
    ::setenv("ASAN_OPTIONS", options.c_str(), 1);
    ::setenv("LD_PRELOAD", "libumockdev-preload.so.0", 1);
    ::execv("/proc/self/exe", argv);
    return EXIT_FAILURE;
  }
  if (!can_mock()) {
    std::fprintf(stderr, "libumockdev-preload.so.0 is missing: install the package umockdev\n");
    return EXIT_FAILURE;
  }
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
