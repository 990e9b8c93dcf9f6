#include "drivers/probes/device_probe.hpp"

#include <algorithm>
#include <thread>

#include <gtest/gtest.h>
#include <libserialport.h>

#include "drivers/probes/open_probe.hpp"
#include "drivers/simulation/pty_master.hpp"
#include "drivers/transports/serial_port.hpp"
#include "tests/drivers/simulation/running_device.hpp"
#include "tests/temporary_folder.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using std::chrono::seconds;

/// The output of a probe.
struct Heard {
  std::vector<ProbeSample> samples;
  std::vector<std::string> notices;
  DeviceCounts counts;

  [[nodiscard]] bool was_told(std::string_view words) const {
    return std::any_of(notices.begin(), notices.end(), [&](const std::string& notice) {
      return notice.find(words) != std::string::npos;
    });
  }
};

/// Reads until `done` returns true.
template <class Done>
Heard listen(Probe& probe, Done done) {
  Heard heard;
  std::vector<ProbeSample> samples(256);
  for (int reads = 0; reads < 20'000 && !done(heard); ++reads) {
    const auto count = probe.read(samples, milliseconds{10});
    EXPECT_TRUE(count.has_value());
    if (!count) break;
    heard.samples.insert(heard.samples.end(), samples.begin(),
                         samples.begin() + static_cast<std::ptrdiff_t>(*count));
    for (std::string& notice : probe.take_notices()) heard.notices.push_back(std::move(notice));
    heard.counts = *probe.device_counts();
  }
  EXPECT_TRUE(done(heard));
  for (std::size_t i = 1; i < heard.samples.size(); ++i) {
    EXPECT_LT(heard.samples[i - 1].time, heard.samples[i].time);
    EXPECT_LT(heard.samples[i - 1].sequence, heard.samples[i].sequence);
  }
  return heard;
}

auto samples(std::size_t count) {
  return [count](const Heard& heard) { return heard.samples.size() >= count; };
}

std::unique_ptr<Probe> opened(const std::string& uri) {
  auto probe = open_probe(uri);
  EXPECT_TRUE(probe.has_value()) << probe.error().sentence;
  return probe ? std::move(*probe) : nullptr;
}

std::string refusal(const std::string& uri) {
  const auto probe = open_probe(uri);
  EXPECT_FALSE(probe.has_value());
  return probe ? "" : probe.error().sentence;
}

/// Expects the samples of the press from some sample on, without gaps.
void expect_the_press(const std::vector<ProbeSample>& samples, std::size_t first) {
  const auto press = dyadic_press(first + samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    ASSERT_EQ(samples[i].depth_mm, press[first + i].depth_mm) << i;
    ASSERT_EQ(samples[i].force_mN, press[first + i].force_mN) << i;
  }
}

TEST(DeviceProbe, GivesThePressSampleForSample) {
  RunningDevice device("hbf1", {});
  const auto probe = opened(device.uri() + "&clock=device");
  ASSERT_NE(probe, nullptr);
  EXPECT_EQ(probe->info().serial_number, "SIM1");
  EXPECT_EQ(probe->info().channels, ProbeSample::kDepth | ProbeSample::kForce);
  EXPECT_EQ(probe->info().period, milliseconds{1});
  EXPECT_FALSE(probe->info().replayed);
  const Heard heard = listen(*probe, samples(500));
  expect_the_press(heard.samples, 0);
  for (std::size_t i = 1; i < heard.samples.size(); ++i) {
    EXPECT_EQ(heard.samples[i].time - heard.samples[i - 1].time, milliseconds{1});
  }
  EXPECT_EQ(heard.counts.lost, 0U);
  EXPECT_EQ(heard.counts.damaged, 0U);
  EXPECT_EQ(heard.counts.reboots, 0U);
}

TEST(DeviceProbe, FramesInPiecesAndInBatchesLoseNothing) {
  RunningDevice split("hbf1", {.split = true});
  RunningDevice batched("hbf1", {.batch = milliseconds{16}});
  const auto in_pieces = opened(split.uri());
  const auto in_batches = opened(batched.uri());
  ASSERT_TRUE(in_pieces && in_batches);
  const Heard pieces = listen(*in_pieces, samples(400));
  const Heard batches = listen(*in_batches, samples(400));
  expect_the_press(pieces.samples, 0);
  expect_the_press(batches.samples, 0);
  EXPECT_EQ(pieces.counts.lost + pieces.counts.damaged, 0U);
  EXPECT_EQ(batches.counts.lost + batches.counts.damaged, 0U);
  EXPECT_GE(batches.counts.largest_batch, 12U);
}

TEST(DeviceProbe, EveryDroppedFrameIsCounted) {
  RunningDevice device("hbf1", {.drop_frame = 0.05});
  const auto probe = opened(device.uri());
  ASSERT_NE(probe, nullptr);
  const Heard heard = listen(*probe, samples(600));
  EXPECT_GT(heard.counts.lost, 10U);
  EXPECT_EQ(heard.counts.damaged, 0U);
  // Lost samples leave gaps in the numbering.
  EXPECT_EQ(heard.samples.back().sequence + 1 - heard.samples.size(), heard.counts.lost);
  const auto press = dyadic_press(2000);
  for (const ProbeSample& sample : heard.samples) {
    ASSERT_EQ(sample.depth_mm, press[sample.sequence].depth_mm);
  }
}

TEST(DeviceProbe, DamagedBytesCostTheirFramesOnly) {
  RunningDevice device("hbf1", {.drop_byte = 0.001, .flip_byte = 0.001});
  const auto probe = opened(device.uri());
  ASSERT_NE(probe, nullptr);
  const Heard heard = listen(*probe, samples(600));
  const auto press = dyadic_press(2000);
  for (const ProbeSample& sample : heard.samples) {
    ASSERT_EQ(sample.depth_mm, press[sample.sequence].depth_mm);
  }
  EXPECT_GT(heard.counts.damaged, 5U);
  EXPECT_GE(heard.counts.lost + 2,
            heard.counts.damaged);  // the last losses may not be detected yet
}

TEST(DeviceProbe, ComesBackAfterItWasUnplugged) {
  const TemporaryFolder folder;
  RunningDevice device("hbf1", {.unplug_at = milliseconds{200}, .unplug_for = milliseconds{300}},
                       folder.path("tty"));
  const auto probe = opened(device.uri());
  ASSERT_NE(probe, nullptr);
  const Heard heard = listen(*probe, [](const Heard& h) {
    return h.counts.outages == 1 && h.was_told("is back") && !h.samples.empty() &&
           h.samples.back().sequence > 800;
  });
  EXPECT_TRUE(heard.was_told("is disconnected"));
  EXPECT_GT(nanoseconds{heard.counts.outage_ns}, milliseconds{100});
  EXPECT_EQ(heard.counts.reboots, 0U);
  // The device kept counting, so the number of missed samples is exact.
  EXPECT_EQ(heard.samples.back().sequence + 1 - heard.samples.size(), heard.counts.lost);
  EXPECT_GT(heard.counts.lost, 100U);
  const auto press = dyadic_press(4000);
  for (const auto& sample : heard.samples) {
    ASSERT_LT(sample.sequence, press.size());
    ASSERT_EQ(sample.depth_mm, press[sample.sequence].depth_mm) << sample.sequence;
  }
}

TEST(DeviceProbe, ARebootIsNoticedAndReadingGoesOn) {
  RunningDevice device("hbf1", {.reboot_at = milliseconds{200}});
  const auto probe = opened(device.uri());
  ASSERT_NE(probe, nullptr);
  const Heard heard = listen(
      *probe, [](const Heard& h) { return h.counts.reboots == 1 && h.samples.size() > 500; });
  EXPECT_EQ(heard.counts.outages, 0U);
}

TEST(DeviceProbe, AStallDelaysButLosesNothing) {
  RunningDevice device("hbf1", {.stall_at = milliseconds{100}, .stall_for = milliseconds{60}});
  const auto probe = opened(device.uri());
  ASSERT_NE(probe, nullptr);
  const Heard heard = listen(*probe, samples(400));
  expect_the_press(heard.samples, 0);
  EXPECT_GE(heard.counts.largest_batch, 30U);
  EXPECT_EQ(heard.counts.lost, 0U);
}

TEST(DeviceProbe, AnEchoIsReportedAndHarmless) {
  RunningDevice device("hbf1", {.echo = true});
  const auto probe = opened(device.uri());
  ASSERT_NE(probe, nullptr);
  const Heard heard = listen(*probe, samples(200));
  EXPECT_TRUE(heard.was_told("echo"));
  EXPECT_EQ(heard.counts.lost + heard.counts.damaged, 0U);
}

TEST(DeviceProbe, TheDriftOfItsClockIsMeasured) {
  RunningDevice device("hbf1", {.drift_ppm = 5000.0});
  const auto probe = opened(device.uri());
  ASSERT_NE(probe, nullptr);
  const Heard heard = listen(
      *probe, [](const Heard& h) { return std::fabs(h.counts.drift_ppm - 5000.0) < 1500.0; });
  EXPECT_TRUE(heard.counts.device_clock);
  EXPECT_TRUE(heard.counts.uncertainty_us || heard.samples.size() < 4000);
}

TEST(DeviceProbe, AWrongBaudRateIsNamed) {
  RunningDevice device("csv", {});
  const std::string sentence = refusal(device.uri() + "&baud=9600&timeout_ms=800");
  EXPECT_NE(sentence.find("that are not csv readings"), std::string::npos) << sentence;
  EXPECT_NE(sentence.find("now 9600 Bd; csv usually runs at 115200"), std::string::npos);
}

TEST(DeviceProbe, TheProtocolThatIsSpokenIsNamed) {
  RunningDevice device("csv", {});
  const std::string port = device.uri().substr(0, device.uri().find('?'));
  const std::string sentence = refusal(port + "?protocol=mark10&timeout_ms=800");
  EXPECT_NE(sentence.find("does not use the protocol mark10"), std::string::npos) << sentence;
  EXPECT_NE(sentence.find("protocol=csv"), std::string::npos) << sentence;
}

TEST(DeviceProbe, ASilentDeviceIsNamed) {
  RunningDevice device("grbl", {});
  const std::string port = device.uri().substr(0, device.uri().find('?'));
  const std::string sentence = refusal(port + "?protocol=hbf1&baud=115200&timeout_ms=300");
  EXPECT_NE(sentence.find("check"), std::string::npos) << sentence;
  PtyMaster nobody;
  ASSERT_TRUE(nobody.plug_in());
  EXPECT_NE(refusal("serial:" + nobody.name() + "?protocol=csv&timeout_ms=150")
                .find("has sent nothing for 0.1 s"),
            std::string::npos);
}

TEST(DeviceProbe, AnOutageWithoutReturnHasItsLength) {
  const TemporaryFolder folder;
  RunningDevice device("hbf1",
                       {.unplug_at = milliseconds{150}, .unplug_for = std::chrono::hours{1}},
                       folder.path("tty"));
  const auto probe = opened(device.uri());
  ASSERT_NE(probe, nullptr);
  const Heard heard =
      listen(*probe, [](const Heard& h) { return h.counts.outage_ns > 100'000'000; });
  EXPECT_EQ(heard.counts.outages, 1U);
  EXPECT_GT(heard.counts.outage_ns, 100'000'000U);
}

TEST(DeviceProbe, PortsThatCannotBeOpenedSayWhy) {
  EXPECT_NE(refusal("serial:/dev/ttyNONE7?protocol=hbf1").find("there is no device"),
            std::string::npos);
  EXPECT_NE(refusal("serial:/dev/null?protocol=hbf1").find("not a serial port"), std::string::npos);
  EXPECT_NE(refusal("serial:/dev/ttyUSB0").find("protocol is missing"), std::string::npos);
  EXPECT_NE(refusal("serial:/dev/ttyUSB0").find("merkel connect serial:/dev/ttyUSB0 recognise"),
            std::string::npos);
  EXPECT_NE(refusal("udp:127.0.0.1:5000").find("merkel connect udp:127.0.0.1:5000 recognise"),
            std::string::npos);
  EXPECT_NE(refusal("serial:?protocol=hbf1").find("names no device"), std::string::npos);
  EXPECT_NE(refusal("serial:/dev/ttyUSB0?protocol=hbf1&bud=9600").find("did you mean baud"),
            std::string::npos);
  RunningDevice device("hbf1", {});
  const auto probe = opened(device.uri());
  EXPECT_NE(refusal(device.uri()).find("in use by another program"), std::string::npos);
}

TEST(DeviceProbe, ACalibrationIsAppliedOnceAndOnlyToItsDevice) {
  const TemporaryFolder folder;
  const std::string head = "date = \"2026-01-01\"\n";
  const std::string force = "[force]\nsource = \"force\"\ngain = 2.0\nzero = 0.125\n";
  RunningDevice device("hbf1", {});
  const auto with = [&](const std::string& text) {
    return device.uri() + "&calibration=" + folder.file("c.toml", text);
  };
  EXPECT_NE(refusal(with("serial_number = \"OTHER\"\n" + head + force)).find("serial number OTHER"),
            std::string::npos);
  EXPECT_NE(refusal(with("[force]\nsource = \"z\"\n")).find("does not have"), std::string::npos);
  EXPECT_NE(refusal(with("[force]\nsource = \"force\"\ngian = 2.0\n")).find("did you mean gain"),
            std::string::npos);
  EXPECT_NE(refusal(device.uri() + "&calibration=" + folder.path("none")).find("check the name"),
            std::string::npos);
  const auto probe =
      opened(with("serial_number = \"SIM1\"\n" + head + force + "saturation = 0.5\n"));
  ASSERT_NE(probe, nullptr);
  const Heard heard = listen(*probe, samples(100));
  const auto press = dyadic_press(100);
  for (std::size_t i = 0; i < 100; ++i) {
    EXPECT_EQ(heard.samples[i].force_mN, 2.0 * (press[i].force_mN - 125.0));
    EXPECT_EQ(heard.samples[i].depth_mm, press[i].depth_mm);
  }
  EXPECT_GT(heard.counts.saturated, 0U);
}

TEST(DeviceProbe, LibserialportItselfReadsThePress) {
  const TemporaryFolder folder;
  RunningDevice device("hbf1", {.unplug_at = milliseconds{150}, .unplug_for = milliseconds{100}},
                       folder.path("tty"));
  // The name leads out of both /dev and /sys/class/tty, where libserialport looks.
  const std::string name = "/dev/../../.." + folder.path("tty");
  sp_port* found = nullptr;
  if (sp_get_port_by_name(name.c_str(), &found) != SP_OK) {
    GTEST_SKIP() << "this libserialport resolves names, so none leads to a pseudo-terminal";
  }
  sp_free_port(found);
  auto port = open_serial_port({.device = name, .baud = 500000});
  ASSERT_TRUE(port.has_value()) << port.error().sentence;
  EXPECT_NE((*port)->info().note.find("low-latency flag set"), std::string::npos);
  const auto uri = Uri::parse("serial:x?protocol=hbf1");
  UriOptions options(*uri);
  auto protocol = (*find_protocol("hbf1"))->make(options);
  auto probe = DeviceProbe::open(std::move(*port), std::move(*protocol),
                                 {.uri = uri->text, .protocol = "hbf1"});
  ASSERT_TRUE(probe.has_value()) << probe.error().sentence;
  const Heard heard = listen(**probe, [](const Heard& h) {
    return h.counts.outages == 1 && h.samples.size() > 300 && h.was_told("is back");
  });
  EXPECT_EQ(heard.samples.back().sequence + 1 - heard.samples.size(), heard.counts.lost);
  EXPECT_EQ(heard.counts.damaged, 0U);
}

/// What is plugged in at a port: who it is and what it measures.
struct Plugged {
  std::string serial_number;
  std::uint32_t channels;
};

/// A port at which a byte comes every millisecond.
class TickingPort : public Transport {
 public:
  [[nodiscard]] const TransportInfo& info() const noexcept override { return info_; }
  [[nodiscard]] Expected<std::size_t, Disconnected> read(std::span<std::uint8_t> bytes,
                                                         nanoseconds /*patience*/) override {
    std::this_thread::sleep_for(milliseconds{1});
    bytes[0] = 0;
    return std::size_t{1};
  }
  [[nodiscard]] Expected<void, Disconnected> write(
      std::span<const std::uint8_t> /*bytes*/) override {
    return {};
  }
  [[nodiscard]] Expected<void, SetupError> reopen() override { return {}; }

 private:
  TransportInfo info_{.name = "port", .serial_number = {}, .note = {}, .report_descriptor = {}};
};

/// A port whose device sends a hundred lines at once, and nothing after them.
class BurstPort final : public TickingPort {
 public:
  [[nodiscard]] Expected<std::size_t, Disconnected> read(std::span<std::uint8_t> bytes,
                                                         nanoseconds /*patience*/) override {
    std::this_thread::sleep_for(milliseconds{1});
    const std::size_t count = std::min(bytes.size(), lines_.size());
    std::copy_n(lines_.begin(), count, bytes.begin());
    lines_.erase(0, count);
    return count;
  }

 private:
  std::string lines_ = [] {
    std::string all;
    for (int i = 100; i < 200; ++i) all += "0." + std::to_string(i) + "\n";
    return all;
  }();
};

/// Makes a reading of every byte, by whatever is plugged in.
class PluggedProtocol final : public Protocol {
 public:
  explicit PluggedProtocol(const Plugged& plugged) : plugged_(plugged) {}
  void begin(nanoseconds /*now*/, DeviceStream& /*stream*/) override {}
  void take(std::span<const std::uint8_t> bytes, nanoseconds arrival,
            DeviceStream& stream) override {
    stream.columns_changed |= std::exchange(told_, plugged_.channels) != plugged_.channels;
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      ++stream.counts.frames;
      DeviceReading reading;
      reading.arrival = arrival;
      reading.set(DeviceChannel::kDepth, 1.0);
      if ((plugged_.channels & bit_of(DeviceChannel::kForce)) != 0U) {
        reading.set(DeviceChannel::kForce, 0.5);
      }
      stream.accept(reading);
    }
  }
  [[nodiscard]] std::string expected(std::string_view /*answer*/) const override { return {}; }
  [[nodiscard]] std::uint32_t channels() const noexcept override { return plugged_.channels; }
  [[nodiscard]] std::string serial_number() const override { return plugged_.serial_number; }

 private:
  const Plugged& plugged_;
  std::uint32_t told_ = 0;
};

TEST(DeviceProbe, OneThatIsSilentAfterItWasRecognisedHasSentNothing) {
  const auto uri = Uri::parse("serial:x?protocol=csv&columns=depth_mm");
  UriOptions options(*uri);
  auto protocol = (*find_protocol("csv"))->make(options);
  ASSERT_TRUE(protocol);
  auto probe = DeviceProbe::open(std::make_unique<BurstPort>(), std::move(*protocol),
                                 {.uri = uri->text, .protocol = "csv"});
  ASSERT_TRUE(probe) << probe.error().sentence;
  Readings readings = (*probe)->readings();
  for (int i = 0; i < 20; ++i) ASSERT_TRUE((*probe)->read(readings, milliseconds{2}));
  EXPECT_EQ((*probe)->device_counts()->bytes, 0U);
}

TEST(DeviceProbe, AnotherDeviceAtItsPortIsNotTakenForIt) {
  const std::uint32_t both = bit_of(DeviceChannel::kForce) | bit_of(DeviceChannel::kDepth);
  Plugged plugged{"A7", both};
  auto probe =
      DeviceProbe::open(std::make_unique<TickingPort>(), std::make_unique<PluggedProtocol>(plugged),
                        {.uri = "x:", .protocol = "test"});
  ASSERT_TRUE(probe) << probe.error().sentence;
  EXPECT_EQ(listen(**probe, samples(10)).counts.refused, 0U);
  plugged = {"B8", both};
  const Heard stranger = listen(**probe, [](const Heard& h) { return h.counts.refused >= 20; });
  EXPECT_TRUE(stranger.samples.empty());
  EXPECT_EQ(stranger.notices.size(), 1U);
  EXPECT_TRUE(stranger.was_told("the press is released"));
  plugged = {"A7", both};
  EXPECT_GE(listen(**probe, samples(10)).samples.size(), 10U);

  plugged = {"A7", bit_of(DeviceChannel::kDepth)};
  const Heard lacking = listen(**probe, [](const Heard& h) { return h.counts.refused >= 40; });
  EXPECT_TRUE(lacking.samples.empty());
  EXPECT_TRUE(lacking.was_told("is released: its device no longer names force;"))
      << lacking.notices.front();
  plugged = {"A7", both};
  EXPECT_GE(listen(**probe, samples(10)).samples.size(), 10U);
}

}  // namespace
}  // namespace merkel
