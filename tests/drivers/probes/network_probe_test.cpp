// Probes over the network, on loopback.
#include <algorithm>
#include <atomic>
#include <functional>
#include <thread>

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "drivers/probes/limited_probe.hpp"
#include "drivers/probes/open_probe.hpp"
#include "drivers/transports/network_port.hpp"
#include "tests/drivers/probes/read_samples.hpp"
#include "tests/drivers/simulation/running_device.hpp"
#include "tests/free_ports.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;

std::string free_port() { return std::to_string(free_ports(1)[0]); }

/// Port 0 of a network address stands for a free one.
DeviceSimulator::Settings settings(std::string_view protocol, std::string network) {
  if (network.ends_with(":0")) network.replace(network.size() - 1, 1, free_port());
  return {.protocol = *find_protocol(protocol),
          .trace = dyadic_press(20'000),
          .network = std::move(network)};
}

TEST(NetworkProbes, OtherMachinesSendOnlyIfAllowed) {
  const std::string port = free_port();
  for (const std::string& uri :
       {"udp:0.0.0.0:" + port + "?protocol=csv&columns=force_N",
        "fused:udp:0.0.0.0:" + port + "?protocol=csv&columns=force_N|udp:127.0.0.1:" + port +
            "?protocol=csv&columns=depth_mm"}) {
    const auto refused = open_probe(uri);
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().sentence.find("--allow-remote"), std::string::npos)
        << refused.error().sentence;
  }
  const auto address = HostAndPort::parse("0.0.0.0:" + port);
  EXPECT_FALSE(open_udp_port({.address = *address, .listen = true}));
  EXPECT_TRUE(open_udp_port({.address = *address, .listen = true, .allow_remote = true}));
  // The port of a device that is asked is not open to others.
  EXPECT_TRUE(open_udp_port({.address = *HostAndPort::parse("192.0.2.1:49152")}));
}

class NetworkProbe : public testing::TestWithParam<std::pair<const char*, const char*>> {};

TEST_P(NetworkProbe, ReadsItsSimulatedDevice) {
  const auto [protocol, address] = GetParam();
  RunningDevice device(settings(protocol, address));
  const std::string_view host(address, std::string_view(address).size() - 1);
  EXPECT_TRUE(device.uri().starts_with(host)) << device.uri();
  auto probe = open_probe(device.uri());
  ASSERT_TRUE(probe.has_value()) << probe.error().sentence;
  const auto samples = read_samples(**probe, 300);
  ASSERT_GE(samples.size(), 300U);
  for (std::size_t i = 1; i < samples.size(); ++i) {
    EXPECT_GT(samples[i].time, samples[i - 1].time);
    EXPECT_TRUE(samples[i].has(ProbeSample::kForce));
  }
  const DeviceCounts counts = *(*probe)->device_counts();
  EXPECT_EQ(counts.damaged, 0U);
  EXPECT_EQ(counts.refused, 0U);
}

INSTANTIATE_TEST_SUITE_P(Loopback, NetworkProbe,
                         testing::Values(std::pair("ati_rdt", "udp:127.0.0.1:0"),
                                         std::pair("csv", "udp:127.0.0.1:0"),
                                         std::pair("csv", "tcp:127.0.0.1:0"),
                                         std::pair("hbf1", "tcp:127.0.0.1:0")));

TEST(NetworkProbe, DatagramsOfOthersAreIgnoredAndCounted) {
  const std::uint16_t port = free_ports(1)[0];
  RunningDevice device(settings("csv", "udp:127.0.0.1:" + std::to_string(port)));
  auto probe = open_probe(device.uri());
  ASSERT_TRUE(probe.has_value()) << probe.error().sentence;
  ASSERT_GE(read_samples(**probe, 20).size(), 20U);
  const int stranger = ::socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const std::string lie = "1,1,900,900\r\n";
  for (int k = 0; k < 50; ++k) {
    ::sendto(stranger, lie.data(), lie.size(), 0, reinterpret_cast<const sockaddr*>(&address),
             sizeof address);
  }
  ::close(stranger);
  const auto samples = read_samples(**probe, 100);
  ASSERT_GE(samples.size(), 100U);
  for (const ProbeSample& sample : samples) EXPECT_LT(sample.force_mN, 2000.0);
  EXPECT_NE((*probe)->device_counts()->port.find("50 from other senders"), std::string::npos)
      << (*probe)->device_counts()->port;
}

/// A UDP socket on loopback.
class Udp {
 public:
  Udp() : socket_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    const sockaddr_in any = address(0);
    EXPECT_EQ(::bind(socket_, reinterpret_cast<const sockaddr*>(&any), sizeof any), 0);
    timeval patience{.tv_sec = 3, .tv_usec = 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  }
  Udp(const Udp&) = delete;
  Udp& operator=(const Udp&) = delete;
  ~Udp() { ::close(socket_); }

  static sockaddr_in address(std::uint16_t port) {
    sockaddr_in result{};
    result.sin_family = AF_INET;
    result.sin_port = htons(port);
    result.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return result;
  }
  [[nodiscard]] std::uint16_t port() const {
    sockaddr_in own{};
    socklen_t length = sizeof own;
    ::getsockname(socket_, reinterpret_cast<sockaddr*>(&own), &length);
    return ntohs(own.sin_port);
  }
  /// Who sent the next datagram; its bytes are left in `heard`.
  std::uint16_t hear() {
    sockaddr_in sender{};
    socklen_t length = sizeof sender;
    heard.resize(2000);
    const auto count = ::recvfrom(socket_, heard.data(), heard.size(), 0,
                                  reinterpret_cast<sockaddr*>(&sender), &length);
    heard.resize(count > 0 ? static_cast<std::size_t>(count) : 0);
    return ntohs(sender.sin_port);
  }
  template <class Container>
  void send(const Container& bytes, std::uint16_t port) const {
    const sockaddr_in to = address(port);
    ::sendto(socket_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&to),
             sizeof to);
  }

  Bytes heard;

 private:
  int socket_;
};

TEST(NetworkProbe, ALongBacklogIsSentInDatagramsThatFitInAPacket) {
  Udp host;
  auto device = settings("csv", "udp:127.0.0.1:" + std::to_string(host.port()));
  device.faults.batch = milliseconds{200};  // some kB of lines
  RunningDevice running(std::move(device));
  // Of 1518 bytes, Ethernet, IPv6 and UDP take up to 66.
  constexpr std::size_t kFitsInAPacket = 1400;
  std::size_t longest = 0;
  for (int heard = 0; heard < 8; ++heard) {
    static_cast<void>(host.hear());
    longest = std::max(longest, host.heard.size());
  }
  EXPECT_LE(longest, kFitsInAPacket);
  EXPECT_GT(longest, kFitsInAPacket / 2);
}

/// A record of a Net F/T: number and force along z.
Bytes net_ft_record(std::uint32_t number, double force_N) {
  Bytes bytes;
  for (const std::uint32_t word :
       {number, number, 0U, 0U, 0U, static_cast<std::uint32_t>(force_N * 1e6), 0U, 0U, 0U}) {
    for (int shift = 24; shift >= 0; shift -= 8) {
      bytes.push_back(static_cast<std::uint8_t>(word >> shift));
    }
  }
  return bytes;
}

TEST(NetworkProbe, ANetFtIsAskedAgainAfterItsRebootAndStrangersAreIgnored) {
  Udp device;
  const Udp stranger;
  std::atomic<bool> done{false};
  std::atomic<int> requests{0};
  // Sends 200 records, falls silent as after a reboot, and begins again when it is asked.
  std::jthread box([&] {
    for (int run = 0; run < 2; ++run) {
      const std::uint16_t host = device.hear();
      ++requests;
      EXPECT_EQ(device.heard, (Bytes{0x12, 0x34, 0, 2, 0, 0, 0, 0}));
      for (std::uint32_t k = 1; k <= 200 && !done.load(); ++k) {
        device.send(net_ft_record(k, 0.5), host);
        stranger.send(net_ft_record(1'000'000 + k, 40.0), host);
        stranger.send(Bytes(36, 0xFF), host);
        device.send(Bytes(7, 0), host);  // its own, but no record
        std::this_thread::sleep_for(milliseconds{2});
      }
    }
  });
  auto probe = open_probe("udp:127.0.0.1:" + std::to_string(device.port()) + "?protocol=ati_rdt");
  ASSERT_TRUE(probe.has_value()) << probe.error().sentence;
  const auto samples = read_samples(**probe, 300);
  done.store(true);
  ASSERT_GE(samples.size(), 300U);
  for (const ProbeSample& sample : samples) EXPECT_NEAR(sample.force_mN, 500.0, 1e-3);
  EXPECT_GE(requests.load(), 2);
  const DeviceCounts counts = *(*probe)->device_counts();
  EXPECT_EQ(counts.damaged, 0U);
  EXPECT_EQ(counts.reboots, 1U);
  EXPECT_NE(counts.port.find("from other senders"), std::string::npos) << counts.port;
}

TEST(NetworkProbe, OldRecordsThatWaitedAreDroppedForTheNewest) {
  Udp device;
  std::jthread box([&] {
    const std::uint16_t host = device.hear();
    for (std::uint32_t k = 1; k <= 500; ++k) device.send(net_ft_record(k, 0.001 * k), host);
    std::this_thread::sleep_for(milliseconds{400});
    for (std::uint32_t k = 501; k <= 600; ++k) {
      device.send(net_ft_record(k, 0.001 * k), host);
      std::this_thread::sleep_for(milliseconds{1});
    }
  });
  auto probe = open_probe("udp:127.0.0.1:" + std::to_string(device.port()) + "?protocol=ati_rdt");
  ASSERT_TRUE(probe.has_value()) << probe.error().sentence;
  // Datagrams that arrived before reading began are stale: the first sample is a current one.
  std::this_thread::sleep_for(milliseconds{300});
  const auto samples = read_samples(**probe, 20);
  ASSERT_GE(samples.size(), 20U);
  EXPECT_GT(samples.front().force_mN, 500.0);
}

TEST(NetworkProbe, AProgramThatSendsLinesMayStartAgain) {
  Udp first;
  std::uint16_t port = 0;
  {
    const Udp free;
    port = free.port();
  }
  std::atomic<bool> on{true};
  std::jthread sender([&] {
    for (; on.load(); std::this_thread::sleep_for(milliseconds{5})) {
      first.send(std::string("0.250\n"), port);
    }
  });
  auto probe =
      open_probe("udp:127.0.0.1:" + std::to_string(port) + "?protocol=csv&columns=force_N");
  ASSERT_TRUE(probe.has_value()) << probe.error().sentence;
  ASSERT_GE(read_samples(**probe, 20).size(), 20U);
  // While the first is heard, another is a stranger.
  const Udp second;
  for (int k = 0; k < 20; ++k) second.send(std::string("9.000\n"), port);
  for (const ProbeSample& sample : read_samples(**probe, 20)) EXPECT_EQ(sample.force_mN, 250.0);
  on.store(false);
  sender.join();
  std::vector<ProbeSample> samples(256);
  double last_mN = 0.0;
  for (int k = 0; k < 300 && last_mN != 125.0; ++k) {
    second.send(std::string("0.125\n"), port);
    const auto count = (*probe)->read(samples, milliseconds{10});
    ASSERT_TRUE(count);
    if (*count > 0) last_mN = samples[*count - 1].force_mN;
  }
  EXPECT_EQ(last_mN, 125.0);
}

TEST(NetworkProbe, AFloodOfStrangersDoesNotDrownTheDevice) {
  std::uint16_t port = 0;
  {
    const Udp free;
    port = free.port();
  }
  std::atomic<bool> on{true};
  std::atomic<int> sent{0};
  std::jthread device([&] {
    const Udp own;
    for (; on.load(); std::this_thread::sleep_for(milliseconds{2})) {
      own.send(std::to_string(++sent) + ",0.250\n", port);
    }
  });
  auto probe =
      open_probe("udp:127.0.0.1:" + std::to_string(port) + "?protocol=csv&columns=seq,force_N");
  ASSERT_TRUE(probe.has_value()) << probe.error().sentence;
  ASSERT_GE(read_samples(**probe, 20).size(), 20U);
  std::jthread stranger([&] {
    const Udp own;
    const std::string lie = "1,40.0\n";
    while (on.load()) {
      for (int k = 0; k < 500; ++k) own.send(lie, port);
      std::this_thread::yield();
    }
  });
  const int before = sent.load();
  const auto samples = read_samples(**probe, 300);
  on.store(false);
  EXPECT_GE(samples.size(), 300U);
  for (const ProbeSample& sample : samples) EXPECT_EQ(sample.force_mN, 250.0);
  const DeviceCounts counts = *(*probe)->device_counts();
  EXPECT_NE(counts.port.find("then shut off"), std::string::npos) << counts.port;
  // All losses happened before the other senders were shut off.
  EXPECT_LT(counts.lost, 0.3 * (sent.load() - before)) << counts.port;
}

TEST(NetworkProbe, ABrokenConnectionIsMadeAgain) {
  DeviceSimulator::Settings faulty = settings("hbf1", "tcp:127.0.0.1:0");
  faulty.faults = {.unplug_at = milliseconds{200}, .unplug_for = milliseconds{200}};
  RunningDevice device(std::move(faulty));
  auto probe = open_probe(device.uri());
  ASSERT_TRUE(probe.has_value()) << probe.error().sentence;
  ASSERT_GE(read_samples(**probe, 800).size(), 800U);
  EXPECT_EQ((*probe)->device_counts()->outages, 1U);
  EXPECT_GT((*probe)->device_counts()->lost, 50U);
}

/// A server that prints lines to its first client until it is told to hang up, hangs up on the next
/// clients at once, and then serves again.
class BusyServer {
 public:
  explicit BusyServer(int busy) : busy_(busy) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(address);
    EXPECT_EQ(::bind(listener_, reinterpret_cast<const sockaddr*>(&address), size), 0);
    EXPECT_EQ(::listen(listener_, 8), 0);
    ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
    port_ = ntohs(address.sin_port);
    thread_ = std::jthread([this](const std::stop_token& stop) {
      serve([this] { return hung_up_.load(); });
      for (int k = 0; k < busy_; ++k) ::close(::accept(listener_, nullptr, nullptr));
      serve([&] { return stop.stop_requested(); });
    });
  }
  ~BusyServer() {
    hang_up();
    ::shutdown(listener_, SHUT_RDWR);  // ends accept()
    thread_ = {};
    ::close(listener_);
  }
  void hang_up() { hung_up_ = true; }
  [[nodiscard]] std::string uri() const {
    return "tcp:127.0.0.1:" + std::to_string(port_) + "?protocol=csv&columns=force_N";
  }

 private:
  void serve(const std::function<bool()>& over) const {
    const int client = ::accept(listener_, nullptr, nullptr);
    for (; client >= 0 && !over(); std::this_thread::sleep_for(milliseconds{1})) {
      static_cast<void>(::send(client, "0.25\n", 5, MSG_NOSIGNAL));
    }
    ::close(client);
  }

  int busy_;
  int listener_ = ::socket(AF_INET, SOCK_STREAM, 0);
  std::uint16_t port_ = 0;
  std::atomic<bool> hung_up_{false};
  std::jthread thread_;
};

TEST(NetworkProbe, AServerThatHangsUpAtOnceIsNoDeviceThatIsBack) {
  BusyServer server(4);
  auto probe = open_probe(server.uri());
  ASSERT_TRUE(probe.has_value()) << probe.error().sentence;
  ASSERT_GE(read_samples(**probe, 50).size(), 50U);
  server.hang_up();
  std::vector<std::string> notices;
  for (int reads = 0; reads < 1000 && notices.size() < 2; ++reads) {
    static_cast<void>(read_samples(**probe, 1));
    for (std::string& notice : (*probe)->take_notices()) notices.push_back(std::move(notice));
  }
  ASSERT_EQ(notices.size(), 2U);
  EXPECT_NE(notices[0].find("is disconnected"), std::string::npos) << notices[0];
  EXPECT_NE(notices[1].find("is back after"), std::string::npos) << notices[1];
  EXPECT_EQ((*probe)->device_counts()->outages, 1U);
  EXPECT_GE((*probe)->device_counts()->outage_ns, 750'000'000U);  // 50 + 100 + 200 + 400 ms
}

TEST(NetworkProbe, WrongAddressesAreNamed) {
  const std::string closed = "tcp:127.0.0.1:" + free_port() + "?protocol=csv&columns=force_N";
  for (const auto& [uri, sentence] :
       {std::pair("udp:127.0.0.1:29827?protocol=mark10", "is not available over udp"),
        std::pair("tcp:127.0.0.1:29827?protocol=ati_rdt", "is not available over tcp"),
        std::pair("udp:127.0.0.1?protocol=csv", "a host and a port are needed"),
        std::pair(closed.c_str(), "cannot reach"),
        std::pair("serial:/dev/null?protocol=ati_rdt", "only available over udp:")}) {
    const auto probe = open_probe(uri);
    ASSERT_FALSE(probe.has_value()) << uri;
    EXPECT_NE(probe.error().sentence.find(sentence), std::string::npos) << probe.error().sentence;
  }
}

TEST(LimitedProbe, ARecordedPressBeyondTheLimitEndsWithAnError) {
  auto open = open_probe("sim:ramp?force_N=113&wait_s=0.01&hold_s=0.05");
  ASSERT_TRUE(open.has_value());
  LimitedProbe probe(std::move(*open), {});
  std::vector<ProbeSample> samples(4096);
  const auto first = probe.read(samples, milliseconds{0});
  ASSERT_TRUE(first.has_value());
  for (std::size_t i = 0; i < *first; ++i) EXPECT_LE(samples[i].force_mN, 50'000.0);
  const auto second = probe.read(samples, milliseconds{0});
  ASSERT_FALSE(second.has_value());
  EXPECT_EQ(second.error(), ProbeError::kBadData);
  EXPECT_NE(probe.error_message().find("increase [probe] max_force_N"), std::string::npos)
      << probe.error_message();
  auto raised = open_probe("sim:ramp?force_N=113&wait_s=0.01&hold_s=0.05");
  LimitedProbe strong(std::move(*raised), {{.force_N = 120.0}});
  EXPECT_TRUE(strong.read(samples, milliseconds{0}).has_value());
  EXPECT_TRUE(strong.error_message().empty());
}

}  // namespace
}  // namespace merkel
