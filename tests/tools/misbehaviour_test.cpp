#include <functional>
#include <optional>
#include <thread>

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "tests/drivers/simulation/running_device.hpp"
#include "tests/free_ports.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/lower_limit.hpp"
#include "tests/tools/program.hpp"
#include "tools/json_text.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using Counts = DeviceSimulator::Counts;

/// A fault of a device, and the counters that it must change.
struct Misbehaviour {
  const char* name;
  SimulatedFaults faults;
  std::function<void(const Json& device, const Counts& did, const std::string& said)> check;
};

std::uint64_t count_of(const Json& device, const char* name) {
  return device.at(name).get<std::uint64_t>();
}

void expect_nothing_lost(const Json& device) {
  // A machine too busy to read loses bytes that do not fit into the terminal.
  constexpr std::uint64_t kReadings = 90;
  if (count_of(device, "largest_batch") > kReadings) return;
  EXPECT_EQ(device["lost"], 0) << device;
  EXPECT_EQ(device["damaged"], 0) << device;
  EXPECT_EQ(device["outages"], 0) << device;
}

const std::vector<Misbehaviour>& misbehaviours() {
  static const std::vector<Misbehaviour> all = {
      {"dropped_frames",
       {.drop_frame = 0.02},
       [](const Json& device, const Counts& did, const std::string&) {
         EXPECT_GT(count_of(device, "lost"), 5U);
         EXPECT_LE(count_of(device, "lost"), did.frames_dropped);
         EXPECT_EQ(device["damaged"], 0);
       }},
      {"dropped_bytes",
       {.drop_byte = 0.001},
       [](const Json& device, const Counts& did, const std::string&) {
         EXPECT_GT(count_of(device, "damaged"), 3U);
         EXPECT_LE(count_of(device, "damaged"), did.bytes_dropped);
         EXPECT_GE(count_of(device, "lost") + 2, count_of(device, "damaged"));
       }},
      {"flipped_bytes",
       {.flip_byte = 0.001},
       [](const Json& device, const Counts& did, const std::string&) {
         EXPECT_GT(count_of(device, "damaged"), 3U);
         // A flip that creates a delimiter breaks one frame into two; a flip that removes one
         // merges two frames.
         EXPECT_LE(count_of(device, "damaged"), 2 * did.bytes_flipped);
         EXPECT_GE(2 * count_of(device, "lost") + 2, count_of(device, "damaged"));
       }},
      {"split_and_merged_frames",
       {.split = true},
       [](const Json& device, const Counts&, const std::string&) { expect_nothing_lost(device); }},
      {"batches_of_16_ms",
       {.batch = milliseconds{16}},
       [](const Json& device, const Counts&, const std::string&) {
         expect_nothing_lost(device);
         EXPECT_GE(count_of(device, "largest_batch"), 12U);
       }},
      {"a_stall",
       {.stall_at = milliseconds{200}, .stall_for = milliseconds{60}},
       [](const Json& device, const Counts&, const std::string&) {
         expect_nothing_lost(device);
         EXPECT_GE(count_of(device, "largest_batch"), 30U);
       }},
      {"a_reboot",
       {.reboot_at = milliseconds{250}},
       [](const Json& device, const Counts& did, const std::string&) {
         EXPECT_EQ(device["reboots"], 1);
         EXPECT_EQ(did.reboots, 1U);
         EXPECT_EQ(device["outages"], 0);
         EXPECT_EQ(device["damaged"], 0);
       }},
      {"an_echo",
       {.echo = true},
       [](const Json& device, const Counts&, const std::string& said) {
         expect_nothing_lost(device);
         EXPECT_NE(said.find("echo"), std::string::npos) << said;
       }},
      {"an_unplug",
       {.unplug_at = milliseconds{250}, .unplug_for = milliseconds{150}},
       [](const Json& device, const Counts& did, const std::string& said) {
         EXPECT_EQ(device["outages"], 1);
         EXPECT_EQ(did.unplugs, 1U);
         EXPECT_GT(count_of(device, "lost"), 100U);
         EXPECT_NE(said.find("is disconnected"), std::string::npos) << said;
         EXPECT_NE(said.find("is back"), std::string::npos) << said;
       }},
      {"a_fast_clock",
       {.drift_ppm = 200.0},
       [](const Json& device, const Counts&, const std::string&) {
         expect_nothing_lost(device);
         EXPECT_EQ(device["device_clock"], true);
       }},
  };
  return all;
}

class EveryMisbehaviour : public testing::TestWithParam<std::size_t> {};

TEST_P(EveryMisbehaviour, IsCountedByTheProgram) {
  const Misbehaviour& misbehaviour = misbehaviours()[GetParam()];
  const TemporaryFolder folder;
  RunningDevice device("hbf1", misbehaviour.faults, folder.path("tty"));
  const auto run =
      run_program({"record", device.uri(), folder.path("t.csv"), "--duration-s", "1.6", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto summary = Json::parse(run.out);
  EXPECT_GT(count_of(summary, "samples"), 300U);
  misbehaviour.check(summary["device"], device.finish(), run.err);
}

INSTANTIATE_TEST_SUITE_P(Devices, EveryMisbehaviour,
                         testing::Range(std::size_t{0}, misbehaviours().size()),
                         [](const auto& entry) { return misbehaviours()[entry.param].name; });

/// A socket that is connected to a port of this machine, or −1.
int connected_to(std::uint16_t port) {
  const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (::connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
    return socket;
  }
  ::close(socket);
  return -1;
}

TEST(Misbehaviour, IdleConnectionsDoNotKeepADeviceFromComingBack) {
  const TemporaryFolder folder;
  RunningDevice device("hbf1", {.unplug_at = milliseconds{6000}, .unplug_for = milliseconds{300}},
                       folder.path("tty"));
  const auto ports = free_ports(2);
  const std::uint16_t page = ports[0];
  const std::uint16_t zmq = ports[1];
  std::optional<StartedProgram> program;
  {
    const LowerLimit few(RLIMIT_NOFILE, 300);
    program.emplace(std::vector<std::string>{
        "run", "--probe", device.uri(), "--duration-s", "10", "--json", "--sink",
        "view:" + std::to_string(page), "--sink", "zmq:tcp://127.0.0.1:" + std::to_string(zmq)});
  }
  // 290 that say nothing, at the page and at the publisher.
  std::vector<int> idle;
  for (int k = 0; k < 1000 && idle.empty(); ++k) {
    const int socket = connected_to(page);
    if (socket >= 0) idle.push_back(socket);
    std::this_thread::sleep_for(milliseconds{10});
  }
  ASSERT_FALSE(idle.empty());
  for (int k = 1; k < 290; ++k) idle.push_back(connected_to(k % 2 == 0 ? page : zmq));
  const ProgramRun run = program->finish();
  for (const int socket : idle) ::close(socket);
  EXPECT_NE(run.err.find("is back"), std::string::npos) << run.err;
  const auto summary = Json::parse(run.out);
  const auto& counts = summary["probes"][0]["device"];
  EXPECT_EQ(counts["outages"], 1) << run.out;
  // At most 6000 before it was unplugged.
  EXPECT_GT(count_of(counts, "readings"), 6500U) << run.out;
}

/// All at once: each gives up after two seconds, or after five without a byte: a board may reset
/// when its port is opened.
TEST(Misbehaviour, AWrongBaudRateIsNamedWhateverTheProtocol) {
  std::vector<std::jthread> programs;
  for (const ProtocolEntry& entry : protocol_table()) {
    programs.emplace_back([&entry] {
      RunningDevice device(entry.name, {});
      std::string uri = device.uri();
      const auto given = uri.find("&baud=");
      if (given != std::string::npos) uri.erase(given, uri.find('&', given + 1) - given);
      const TemporaryFolder folder;
      const auto run = run_program({"record", uri + "&baud=9600", folder.path("t.csv")});
      EXPECT_EQ(run.exit_code, 3) << entry.name;
      const bool sends = run.err.find(" bytes ") != std::string::npos;
      EXPECT_NE(run.err.find(sends ? "2.0 s" : "5.0 s"), std::string::npos) << run.err;
      EXPECT_NE(run.err.find("the baud rate (now 9600 Bd"), std::string::npos) << run.err;
    });
  }
}

/// Only a streaming device: a polled one stays silent under another protocol.
TEST(Misbehaviour, AWrongProtocolGetsTheLikelyOneSuggested) {
  std::vector<std::jthread> programs;
  for (const std::string asked :
       {"mark10", "esm", "hbf1", "optoforce&counts_per_N=1", "zaber&um_per_step=1", "grbl"}) {
    programs.emplace_back([asked] {
      RunningDevice device("csv", {});
      const std::string port = device.uri().substr(0, device.uri().find('?'));
      const TemporaryFolder folder;
      const auto run = run_program(
          {"record", port + "?protocol=" + asked + "&baud=115200", folder.path("t.csv")});
      EXPECT_EQ(run.exit_code, 3) << asked;
      EXPECT_NE(run.err.find("so use protocol=csv"), std::string::npos) << asked << run.err;
    });
  }
}

TEST(Misbehaviour, BetweenBurstsOfHalfASecondThePressIsReleasedLiveAndInTheReplay) {
  const TemporaryFolder folder;
  RunningDevice device("hbf1", {.batch = milliseconds{500}});
  const std::string session = folder.path("s.xdf");
  const auto run = run_program({"run", "goodwin", "--probe", device.uri(), "--duration-s", "4",
                                "--json", "--sink", "xdf:" + session});
  const Json json = Json::parse(run.out);
  EXPECT_GE(json["releases"], 4) << run.out;
  EXPECT_GT(json["released_ticks"], 500) << run.out;
  const auto replay = run_program({"replay", session});
  EXPECT_EQ(replay.exit_code, 0) << replay.out;
}

}  // namespace
}  // namespace merkel
