#include "drivers/probes/forwarding_probe.hpp"

#include <fstream>
#include <regex>
#include <set>

#include <gtest/gtest.h>

#include "drivers/calibration/probe_calibration.hpp"

namespace merkel {
namespace {

/// Notes which of its functions were called, and answers what no default answers.
class NotingProbe final : public Probe {
 public:
  explicit NotingProbe(std::multiset<std::string>& calls) : calls_(calls) {}

  [[nodiscard]] const ProbeInfo& info() const noexcept override {
    calls_.insert("info");
    return info_;
  }
  [[nodiscard]] std::size_t outputs() const noexcept override {
    calls_.insert("outputs");
    return 4;
  }
  [[nodiscard]] const ProbeInfo& info_of(std::size_t output) const noexcept override {
    EXPECT_EQ(output, 3U);
    calls_.insert("info_of");
    return info_;
  }
  [[nodiscard]] Expected<std::size_t, ProbeError> read(
      std::span<ProbeSample> samples, std::chrono::milliseconds /*patience*/) override {
    calls_.insert("read");
    return samples.size();
  }
  [[nodiscard]] std::span<const float> taxels(const ProbeSample& /*sample*/) const override {
    calls_.insert("taxels");
    return taxels_;
  }
  [[nodiscard]] std::string error_message() const override {
    calls_.insert("error_message");
    return "broken";
  }
  [[nodiscard]] std::optional<DeviceCounts> device_counts() const override {
    calls_.insert("device_counts");
    return DeviceCounts{{.readings = 7}};
  }
  [[nodiscard]] bool is_timed() const noexcept override {
    calls_.insert("is_timed");
    return true;
  }
  [[nodiscard]] std::optional<SampleTiming> timing() const override {
    calls_.insert("timing");
    return SampleTiming{.period = std::chrono::milliseconds{3}};
  }
  [[nodiscard]] const ProbeCalibration* calibration() const noexcept override {
    calls_.insert("calibration");
    return &calibration_;
  }
  [[nodiscard]] std::vector<std::string> take_notices() override {
    calls_.insert("take_notices");
    return {"unplugged"};
  }
  [[nodiscard]] bool request_tare(std::size_t output) noexcept override {
    EXPECT_EQ(output, 3U);
    calls_.insert("request_tare");
    return true;
  }
  [[nodiscard]] bool connected() const noexcept override {
    calls_.insert("connected");
    return false;
  }
  [[nodiscard]] std::size_t ports() const noexcept override {
    calls_.insert("ports");
    return 3;
  }
  void add_listener(std::size_t port, PortListener& /*listener*/) override {
    EXPECT_EQ(port, 2U);
    calls_.insert("add_listener");
  }
  void remove_listener(std::size_t port, PortListener& /*listener*/) override {
    EXPECT_EQ(port, 2U);
    calls_.insert("remove_listener");
  }

 private:
  std::multiset<std::string>& calls_;
  std::vector<float> taxels_ = {1.0F, 2.0F};
  ProbeInfo info_{.uri = "mock:", .name = "mock"};
  ProbeCalibration calibration_;
};

class NoListener final : public PortListener {
 public:
  void take(const RawFrame& /*frame*/) noexcept override {}
  void missed(std::uint64_t /*frames*/) noexcept override {}
};

/// The virtual functions of class Probe, as its header declares them.
std::multiset<std::string> functions_of_probe() {
  std::ifstream file("drivers/probe.hpp");
  std::string header((std::istreambuf_iterator<char>(file)), {});
  header.erase(0, header.find("class Probe {"));
  // A declaration may break after its name or before its parameters.
  const std::regex declared(R"(virtual [^~;{]*?(\w+)\()");
  std::multiset<std::string> names;
  for (std::sregex_iterator found(header.begin(), header.end(), declared), end; found != end;
       ++found) {
    names.insert((*found)[1]);
  }
  return names;
}

TEST(ForwardingProbe, PassesEveryFunctionOfAProbeOn) {
  std::multiset<std::string> calls;
  ForwardingProbe probe(std::make_unique<NotingProbe>(calls));
  std::vector<ProbeSample> samples(5);
  NoListener listener;
  EXPECT_EQ(probe.info().uri, "mock:");
  EXPECT_EQ(*probe.read(samples, std::chrono::milliseconds{1}), 5U);
  EXPECT_EQ(probe.taxels(samples[0]).size(), 2U);
  EXPECT_EQ(probe.error_message(), "broken");
  EXPECT_EQ(probe.device_counts()->readings, 7U);
  EXPECT_TRUE(probe.is_timed());
  EXPECT_EQ(probe.timing()->period, std::chrono::milliseconds{3});
  EXPECT_NE(probe.calibration(), nullptr);
  EXPECT_EQ(probe.take_notices().size(), 1U);
  EXPECT_TRUE(probe.request_tare(3));
  EXPECT_EQ(probe.outputs(), 4U);
  EXPECT_EQ(probe.info_of(3).uri, "mock:");
  EXPECT_FALSE(probe.connected());
  EXPECT_EQ(probe.ports(), 3U);
  probe.add_listener(2, listener);
  probe.remove_listener(2, listener);
  // A function that is added to Probe fails here until it is passed on, and called above.
  const auto declared = functions_of_probe();
  EXPECT_GE(declared.size(), 13U);
  EXPECT_EQ(calls, declared);
}

}  // namespace
}  // namespace merkel
