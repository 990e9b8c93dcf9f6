// Probes over the network, on loopback.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "drivers/probes/limited_probe.hpp"
#include "drivers/probes/open_probe.hpp"
#include "tests/drivers/simulation/running_device.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;

std::vector<ProbeSample> read(Probe& probe, std::size_t count) {
  std::vector<ProbeSample> all;
  std::vector<ProbeSample> samples(256);
  for (int reads = 0; reads < 2000 && all.size() < count; ++reads) {
    const auto got = probe.read(samples, milliseconds{10});
    if (!got) break;
    all.insert(all.end(), samples.begin(), samples.begin() + static_cast<std::ptrdiff_t>(*got));
  }
  return all;
}

DeviceSimulator::Settings settings(std::string_view protocol, std::string network) {
  return {.protocol = *find_protocol(protocol),
          .trace = dyadic_press(20'000),
          .network = std::move(network)};
}

class NetworkProbe : public testing::TestWithParam<std::pair<const char*, const char*>> {};

TEST_P(NetworkProbe, ReadsItsSimulatedDevice) {
  const auto [protocol, address] = GetParam();
  RunningDevice device(settings(protocol, address));
  EXPECT_TRUE(device.uri().starts_with(address)) << device.uri();
  auto probe = open_probe(device.uri());
  ASSERT_TRUE(probe.has_value()) << probe.error().sentence;
  const auto samples = read(**probe, 300);
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
                         testing::Values(std::pair("ati_rdt", "udp:127.0.0.1:49821"),
                                         std::pair("csv", "udp:127.0.0.1:49822"),
                                         std::pair("csv", "tcp:127.0.0.1:49823"),
                                         std::pair("hbf1", "tcp:127.0.0.1:49824")));

TEST(NetworkProbe, DatagramsOfOthersAreIgnoredAndCounted) {
  RunningDevice device(settings("csv", "udp:127.0.0.1:49825"));
  auto probe = open_probe(device.uri());
  ASSERT_TRUE(probe.has_value()) << probe.error().sentence;
  ASSERT_GE(read(**probe, 20).size(), 20U);
  const int stranger = ::socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(49825);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const std::string lie = "1,1,900,900\r\n";
  for (int k = 0; k < 50; ++k) {
    ::sendto(stranger, lie.data(), lie.size(), 0, reinterpret_cast<const sockaddr*>(&address),
             sizeof address);
  }
  ::close(stranger);
  const auto samples = read(**probe, 100);
  ASSERT_GE(samples.size(), 100U);
  for (const ProbeSample& sample : samples) EXPECT_LT(sample.force_mN, 2000.0);
  EXPECT_NE((*probe)->device_counts()->port.find("50 of other senders"), std::string::npos)
      << (*probe)->device_counts()->port;
}

TEST(NetworkProbe, ABrokenConnectionIsMadeAgain) {
  DeviceSimulator::Settings faulty = settings("hbf1", "tcp:127.0.0.1:49826");
  faulty.faults = {.unplug_at = milliseconds{200}, .unplug_for = milliseconds{200}};
  RunningDevice device(std::move(faulty));
  auto probe = open_probe(device.uri());
  ASSERT_TRUE(probe.has_value()) << probe.error().sentence;
  ASSERT_GE(read(**probe, 800).size(), 800U);
  EXPECT_EQ((*probe)->device_counts()->outages, 1U);
  EXPECT_GT((*probe)->device_counts()->lost, 50U);
}

TEST(NetworkProbe, WrongAddressesAreNamed) {
  for (const auto& [uri, sentence] :
       {std::pair("udp:127.0.0.1:49827?protocol=mark10", "is not available over udp"),
        std::pair("tcp:127.0.0.1:49827?protocol=ati_rdt", "is not available over tcp"),
        std::pair("udp:127.0.0.1?protocol=csv", "a host and a port are needed"),
        std::pair("tcp:127.0.0.1:49828?protocol=csv&columns=force_N", "cannot reach"),
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
  LimitedProbe strong(std::move(*raised), {.force_N = 120.0});
  EXPECT_TRUE(strong.read(samples, milliseconds{0}).has_value());
  EXPECT_TRUE(strong.error_message().empty());
}

}  // namespace
}  // namespace merkel
