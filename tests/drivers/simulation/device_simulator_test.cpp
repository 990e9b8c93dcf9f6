#include "drivers/simulation/device_simulator.hpp"

#include <thread>

#include <gtest/gtest.h>

#include "drivers/transports/serial_port.hpp"
#include "tests/drivers/simulation/running_device.hpp"
#include "tests/temporary_folder.hpp"

namespace merkel {
namespace {

TEST(DeviceSimulator, CountsTheBytesThatItsHostDoesNotRead) {
  constexpr std::uint64_t kTerminalHolds = 65'536;  // at most
  const TemporaryFolder folder;
  RunningDevice device("csv", {}, folder.path("tty"));
  const auto host = open_serial({.device = folder.path("tty"), .baud = 115'200});
  ASSERT_TRUE(host) << host.error().sentence;
  std::this_thread::sleep_for(std::chrono::seconds{1});  // some 20 kB of lines
  const DeviceSimulator::Counts& counts = device.finish();
  EXPECT_GT(counts.bytes_sent, 1000U);
  EXPECT_LT(counts.bytes_sent, kTerminalHolds);
  EXPECT_GT(counts.bytes_overrun, 0U);
  EXPECT_LT(counts.bytes_overrun, 1'000'000U);
}

}  // namespace
}  // namespace merkel
