// The column of a sync line, as a device prints it.
#include <chrono>
#include <cstdio>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include "tests/free_ports.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/text_has.hpp"
#include "tests/tools/program.hpp"

namespace merkel {
namespace {

/// A board that sends a line every 2 ms, and whose sync line changes every 0.2 s.
class SyncBoard {
 public:
  /// \param format  of time in s, force in N and level, for printf
  SyncBoard(std::uint16_t port, const char* format, const char* low, const char* high) {
    thread_ = std::jthread([=](const std::stop_token& stop) {
      const int sender = ::socket(AF_INET, SOCK_DGRAM, 0);
      sockaddr_in to{};
      to.sin_family = AF_INET;
      to.sin_port = htons(port);
      to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      const auto start = std::chrono::steady_clock::now();
      for (int k = 0; !stop.stop_requested(); ++k) {
        char line[128];
        const int size = std::snprintf(line, sizeof line, format, 2e-3 * k, 1e-3 * (k % 3),
                                       k / 100 % 2 == 0 ? low : high);
        static_cast<void>(::sendto(sender, line, static_cast<std::size_t>(size), 0,
                                   reinterpret_cast<const sockaddr*>(&to), sizeof to));
        std::this_thread::sleep_until(start + (k + 1) * std::chrono::milliseconds{2});
      }
      ::close(sender);
    });
  }

 private:
  std::jthread thread_;
};

TEST(SyncColumn, OfCsvAndOfJsonHasTheSameEdgesAndIsNoSensor) {
  struct Case {
    const char* format;
    const char* low;
    const char* high;
    std::string columns;  // empty: the lines name them
  };
  for (const Case& each :
       {Case{"%.3f,%.3f,%s\n", "0", "1", "&columns=time_s,force_N,sync"},
        Case{"{\"time_s\":%.3f,\"force_N\":%.3f,\"sync\":%s}\n", "0", "1", ""},
        Case{"{\"time_s\":%.3f,\"force_N\":%.3f,\"sync\":%s}\n", "false", "true", ""},
        Case{"{\"t\":%.3f,\"f\":%.3f,\"ttl\":%s}\n", "0", "1",
             "&columns=t:time_s,f:force_N,ttl:sync"},
        Case{"[%.3f,%.3f,%s]\n", "false", "true", "&columns=time_s,force_N,sync"}}) {
    const TemporaryFolder folder;
    const std::uint16_t port = free_ports(1)[0];
    const SyncBoard board(port, each.format, each.low, each.high);
    const std::string uri = "udp:127.0.0.1:" + std::to_string(port) + "?protocol=csv";
    const std::string session = folder.path("s.xdf");
    const auto run = run_program(
        {"run", "--probe", uri + each.columns, "--duration-s", "1.5", "--record", session});
    ASSERT_TRUE(run.exit_code == 0 || run.exit_code == 1) << run.err;
    std::istringstream rows(run_program({"inspect", "session", session, "--stream", "sync"}).out);
    std::string row;
    std::getline(rows, row);
    EXPECT_EQ(row, "time_s,probe,line,level");
    std::vector<double> times_s;
    std::vector<int> levels;
    while (std::getline(rows, row)) {
      times_s.push_back(std::stod(row));
      EXPECT_TRUE(has(row, ",0,1,")) << row;
      levels.push_back(row.back() - '0');
    }
    ASSERT_GE(levels.size(), 4U) << each.format;
    for (std::size_t i = 1; i < levels.size(); ++i) {
      EXPECT_NE(levels[i], levels[i - 1]);
      EXPECT_NEAR(times_s[i] - times_s[i - 1], 0.2, 0.02);
    }
    if (!each.columns.empty()) continue;
    const auto connected = run_program({"connect", "udp:127.0.0.1:" + std::to_string(port), "--yes",
                                        "--out", folder.path("s.toml")});
    ASSERT_EQ(connected.exit_code, 0) << connected.err << connected.out;
    const std::string scene = read_file(folder.path("s.toml"));
    EXPECT_TRUE(has(scene, "columns=time_s,force_N,sync")) << scene;
    EXPECT_FALSE(has(scene, "preset = \"hand\"")) << scene;
  }
}

}  // namespace
}  // namespace merkel
