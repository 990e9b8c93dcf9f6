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

  [[nodiscard]] std::span<const ProbeInfo> outputs() const noexcept override {
    calls_.insert("outputs");
    return {&info_, 1};
  }
  [[nodiscard]] Expected<std::size_t, ProbeError> read(
      Readings& readings, std::chrono::milliseconds /*patience*/) override {
    calls_.insert("read");
    return readings.room();
  }
  [[nodiscard]] std::string error_message() const override {
    calls_.insert("error_message");
    return "broken";
  }
  [[nodiscard]] ProbeStatus status() const override {
    calls_.insert("status");
    return {.device = DeviceCounts{{.readings = 7}},
            .timed = true,
            .timing = SampleTiming{.period = std::chrono::milliseconds{3}},
            .connected = false,
            .calibration = &calibration_};
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
  NoListener listener;
  EXPECT_EQ(probe.outputs()[0].uri, "mock:");
  Readings readings{ReadingColumns(), 5};
  EXPECT_EQ(*probe.read(readings, std::chrono::milliseconds{1}), 5U);
  EXPECT_EQ(probe.error_message(), "broken");
  const ProbeStatus status = probe.status();
  EXPECT_EQ(status.device->readings, 7U);
  EXPECT_TRUE(status.timed);
  EXPECT_EQ(status.timing->period, std::chrono::milliseconds{3});
  EXPECT_NE(status.calibration, nullptr);
  EXPECT_FALSE(status.connected);
  EXPECT_EQ(probe.take_notices().size(), 1U);
  EXPECT_TRUE(probe.request_tare(3));
  EXPECT_EQ(probe.ports(), 3U);
  probe.add_listener(2, listener);
  probe.remove_listener(2, listener);
  // A function that is added to Probe fails here until it is passed on, and called above.
  const auto declared = functions_of_probe();
  EXPECT_GE(declared.size(), 9U);
  EXPECT_LE(declared.size(), 12U);  // and the destructor
  EXPECT_EQ(calls, declared);
}

}  // namespace
}  // namespace merkel
