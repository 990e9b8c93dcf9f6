// A Lab Streaming Layer inlet as a probe: with liblsl if it is installed, else with a replacement
// (lsl_stub), so that this side of the interface is always compiled and run.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <lsl_cpp.h>

#include "core/units.hpp"
#include "drivers/clock/clock_pair.hpp"
#include "drivers/probes/open_device.hpp"
#include "tests/drivers/probes/read_samples.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;

/// A gauge on a stage as an outlet, like the LSL bridge of an amplifier or a robot.
class Outlet {
 public:
  explicit Outlet(
      std::string name,
      const std::vector<std::pair<const char*, const char*>>& channels = {{"force", "N"},
                                                                          {"temperature", "C"},
                                                                          {"depth", "mm"}},
      const char* source = "gauge-7", double offset = 0.25,
      double (*stamp_s)(int) = [](int) { return 0.0; })
      : name_(std::move(name)), width_(channels.size()) {
    lsl::stream_info info(name_, "Touch", static_cast<int>(channels.size()), 200.0,
                          lsl::cf_double64, source);
    lsl::xml_element list = info.desc().append_child("channels");
    for (const auto& [label, unit] : channels) {
      list.append_child("channel")
          .append_child_value("label", label)
          .append_child_value("unit", unit);
    }
    outlet_ = std::make_unique<lsl::stream_outlet>(info);
    thread_ = std::jthread([this, offset, stamp_s](const std::stop_token& stop) {
      for (int k = 0; !stop.stop_requested(); ++k) {
        std::vector<double> values(width_, offset + 0.001 * (k % 100));
        outlet_->push_sample(values, stamp_s(k));
        std::this_thread::sleep_for(milliseconds{5});
      }
    });
  }
  ~Outlet() {
    thread_.request_stop();
    thread_.join();
  }

 private:
  std::string name_;
  std::size_t width_;
  std::unique_ptr<lsl::stream_outlet> outlet_;
  std::jthread thread_;
};

std::string unique_name() {
  return "merkel-test-" + std::to_string(read_clock_pair().monotonic.count());
}

Expected<std::unique_ptr<Probe>, SetupError> open(const std::string& text) {
  return open_lsl_device(*Uri::parse(text), {});
}

TEST(LslProbe, ReadsAStreamByTheLabelsOfItsChannels) {
  const std::string name = unique_name();
  const Outlet outlet(name);
  const auto probe = open("lsl:" + name);
  ASSERT_TRUE(probe) << probe.error().sentence;
  EXPECT_EQ((*probe)->info().serial_number, "gauge-7");
  EXPECT_EQ((*probe)->info().period, milliseconds{5});
  EXPECT_EQ((*probe)->info().channels, ProbeSample::kForce | ProbeSample::kDepth);
  const auto samples = read_samples(**probe, 60);
  ASSERT_GE(samples.size(), 60U);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    EXPECT_GE(samples[i].depth_mm, 0.25);
    EXPECT_NEAR(samples[i].force_mN, 1e3 * samples[i].depth_mm, 1e-9);
    if (i > 0) {
      EXPECT_GT(samples[i].time, samples[i - 1].time);
    }
    // LSL's clock is this machine's monotonic one.
    EXPECT_LE(samples[i].time, samples[i].arrival + milliseconds{5});
    EXPECT_GE(samples[i].time, samples[i].arrival - milliseconds{500});
  }
  EXPECT_EQ((*probe)->device_counts()->damaged, 0U);
  EXPECT_TRUE((*probe)->device_counts()->device_clock);
}

const std::vector<std::pair<const char*, const char*>> kForceOnly = {{"force", "N"}};

// LSL's own rule: a stamp is in the time of local_clock(), for an inlet as for its outlet.
TEST(LslProbe, StampsAreUsedAsTheyAre) {
  for (const std::string option : {"", "?clock=device"}) {
    const std::string name = unique_name();
    // Whole milliseconds in the past, by an amount that differs from sample to sample.
    const Outlet outlet(name, kForceOnly, "gauge-9", 0.25, [](int k) {
      return std::floor(1000.0 * lsl::local_clock() - k % 3) / 1000.0;
    });
    const auto probe = open("lsl:" + name + option);
    ASSERT_TRUE(probe) << probe.error().sentence;
    const auto samples = read_samples(**probe, 60);
    ASSERT_GE(samples.size(), 60U);
    std::size_t exact = 0;
    for (const ProbeSample& sample : samples) {
      // Exact but for the rounding of LSL's double.
      const auto beyond_ms = (sample.time + std::chrono::nanoseconds{50}) % milliseconds{1};
      if (beyond_ms < std::chrono::nanoseconds{100}) ++exact;
    }
    // A sample that would go backwards is put one nanosecond after the one before.
    EXPECT_EQ(exact, samples.size());
    const DeviceCounts counts = *(*probe)->device_counts();
    EXPECT_EQ(counts.clock_outliers, 0U);
    EXPECT_EQ(counts.jitter_us, 0.0);
    EXPECT_EQ(counts.drift_ppm, 0.0);
    EXPECT_GT(counts.latency_us, 0.0);
  }
}

#ifdef MERKEL_LSL_STUB
TEST(LslProbe, StampsOfAContainerWithAClockOfItsOwnHaveLslsOffset) {
  lsl::offset_s() = 5000.0;
  const std::string name = unique_name();
  const Outlet outlet(name, kForceOnly, "gauge-11", 0.25,
                      [](int) { return lsl::local_clock() - 5000.0; });
  const auto probe = open("lsl:" + name);
  lsl::offset_s() = 0.0;
  ASSERT_TRUE(probe) << probe.error().sentence;
  const auto samples = read_samples(**probe, 60);
  for (const ProbeSample& sample : samples) {
    EXPECT_NEAR(units::ms_from(sample.arrival - sample.time), 0.0, 500.0);
  }
  EXPECT_EQ((*probe)->device_counts()->clock_outliers, 0U);
}
#endif

TEST(LslProbe, StampsOfAnotherClockAreMappedAndReported) {
  const std::string name = unique_name();
  const Outlet outlet(name, kForceOnly, "gauge-10", 0.25,
                      [](int) { return lsl::local_clock() + 1e5; });
  const auto probe = open("lsl:" + name);
  ASSERT_TRUE(probe) << probe.error().sentence;
  const auto samples = read_samples(**probe, 100);
  ASSERT_GE(samples.size(), 100U);
  for (const ProbeSample& sample : samples) {
    EXPECT_NEAR(units::ms_from(sample.arrival - sample.time), 0.0, 500.0);
  }
  const auto notices = (*probe)->take_notices();
  EXPECT_TRUE(std::any_of(notices.begin(), notices.end(), [](const std::string& notice) {
    return notice.find("not on this machine's clock") != std::string::npos;
  }));
}

TEST(LslProbe, ColumnsCanBeNamedWhereTheLabelsSayNothing) {
  const std::string name = unique_name();
  const Outlet outlet(name, {{"EEG1", ""}, {"EEG2", ""}});
  const auto unnamed = open("lsl:" + name);
  ASSERT_FALSE(unnamed);
  EXPECT_NE(unnamed.error().sentence.find("columns="), std::string::npos)
      << unnamed.error().sentence;
  // Its advice, followed.
  const auto probe = open("lsl:" + name + "?columns=-,force_mN");
  ASSERT_TRUE(probe) << probe.error().sentence;
  const auto samples = read_samples(**probe, 5);
  ASSERT_GE(samples.size(), 5U);
  EXPECT_LT(samples[0].force_mN, 1.0);
}

/// A probe that has read its outlet, which is gone then.
Expected<std::unique_ptr<Probe>, SetupError> open_and_lose_outlet(const std::string& name) {
  const Outlet outlet(name);
  auto probe = open("lsl:" + name);
  EXPECT_TRUE(probe) << probe.error().sentence;
  if (probe) {
    EXPECT_GE(read_samples(**probe, 20).size(), 20U);
  }
  return probe;
}

TEST(LslProbe, AnOutletThatGoesIsAnOutageAndItsReturnIsNoticed) {
  const std::string name = unique_name();
  const auto probe = open_and_lose_outlet(name);
  ASSERT_TRUE(probe);
  std::vector<ProbeSample> samples(256);
  for (int reads = 0; reads < 1000 && (*probe)->status().connected; ++reads) {
    ASSERT_TRUE((*probe)->read(samples, milliseconds{10}));
  }
  EXPECT_FALSE((*probe)->status().connected);
  const Outlet returned(name);
  EXPECT_GE(read_samples(**probe, 20).size(), 20U);
  EXPECT_EQ((*probe)->device_counts()->outages, 1U);
}

TEST(LslProbe, AfterAnOutageAnotherStreamOfItsNameIsNotTakenForIt) {
  const std::string name = unique_name();
  const auto probe = open_and_lose_outlet(name);
  ASSERT_TRUE(probe);
  const std::vector<std::pair<const char*, const char*>> same = {
      {"force", "N"}, {"temperature", "C"}, {"depth", "mm"}};
  const Outlet other_source(name, same, "gauge-8", 5.0);
  const Outlet other_width(name, {{"force", "N"}, {"depth", "mm"}}, "gauge-7", 6.0);
  std::vector<ProbeSample> samples(256);
  // Until the outage is noticed, which takes liblsl some seconds, and for a while after it.
  for (int reads = 0, after = 0; reads < 2000 && after < 150; ++reads) {
    if (!(*probe)->status().connected) ++after;
    const auto got = (*probe)->read(samples, milliseconds{10});
    ASSERT_TRUE(got);
    for (std::size_t i = 0; i < *got; ++i) ASSERT_LT(samples[i].depth_mm, 1.0);
  }
  EXPECT_FALSE((*probe)->status().connected);
}

TEST(LslProbe, UnreadableStreamsAreNamed) {
  EXPECT_NE(open("lsl:").error().sentence.find("name the stream"), std::string::npos);
  const auto missing = open("lsl:" + unique_name());
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().kind, SetupError::Kind::kUnavailable);
  EXPECT_NE(missing.error().sentence.find("start its outlet"), std::string::npos);
  const std::string name = unique_name();
  const Outlet outlet(name);
  EXPECT_FALSE(open("lsl:" + name + "?colums=force_N"));
  const auto foreign = open("lsl:" + name + "?host=elsewhere");
  ASSERT_FALSE(foreign);
  EXPECT_NE(foreign.error().sentence.find("host="), std::string::npos) << foreign.error().sentence;
}

}  // namespace
}  // namespace merkel
