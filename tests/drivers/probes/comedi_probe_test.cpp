// Data-acquisition cards, with comedilib's calls replaced by a card in virtual time (comedi_stub).
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <string>
#include <vector>

#include <comedilib.h>
#include <gtest/gtest.h>

#include "core/units.hpp"
#include "drivers/probes/device_probe.hpp"
#include "drivers/probes/measured_probe.hpp"
#include "drivers/probes/open_device.hpp"
#include "drivers/protocols/analog_scans.hpp"
#include "drivers/transports/comedi_port.hpp"
#include "tests/drivers/transports/comedi_stub.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/text_has.hpp"
#include "tools/doctor/probe_report.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using std::chrono::seconds;

class ComediProbe : public testing::Test {
 protected:
  ComediProbe() { fake_comedi_card = &card; }
  ~ComediProbe() override { fake_comedi_card = nullptr; }

  static Expected<std::unique_ptr<Probe>, SetupError> open(const std::string& options) {
    return open_comedi_device(*Uri::parse("comedi:/dev/comedi0?" + options), {});
  }
  static std::string refusal(const std::string& options) {
    const auto probe = open(options);
    EXPECT_FALSE(probe.has_value());
    return probe ? "" : probe.error().sentence;
  }
  /// A probe that reads the card's raw values as mN and µm, in the card's virtual time.
  std::unique_ptr<Probe> in_virtual_time(const ComediSettings& settings) {
    auto opened = open_comedi_card(settings);
    EXPECT_TRUE(opened) << opened.error().sentence;
    AnalogFormat& format = opened->format;
    format.conversions.clear();
    std::string names;
    for (std::size_t i = 0; i < settings.channels.size(); ++i) {
      names += i == 0 ? "force_mN" : ",c" + std::to_string(i) + "_um";
      format.conversions.push_back({.coefficients = {0.0, 1.0}, .largest = card.largest});
    }
    format.columns = *csv_columns_named(names, ',');
    auto probe = DeviceProbe::open(std::move(opened->port), make_analog_scans(std::move(format)),
                                   {.uri = "comedi:fake",
                                    .protocol = "comedi",
                                    .times = ReadingTimes::Rule::kBuffered,
                                    .clock = &card.clock});
    EXPECT_TRUE(probe) << probe.error().sentence;
    return std::move(*probe);
  }

  FakeComediCard card;
};

/// The samples of a probe, and what it reports.
struct Listened {
  std::vector<ProbeSample> samples;
  std::vector<std::string> notices;
};

Listened listen_for(Probe& probe, VirtualHostClock& clock, nanoseconds length) {
  Listened heard;
  Readings readings = probe.readings();
  const nanoseconds end = clock.time + length;
  while (clock.time < end) {
    const auto count = probe.read(readings, milliseconds{10});
    EXPECT_TRUE(count);
    if (!count) break;
    for (std::size_t i = 0; i < *count; ++i) heard.samples.push_back(*readings.sample(i));
    for (std::string& notice : probe.take_notices()) heard.notices.push_back(std::move(notice));
  }
  return heard;
}

bool any_has(const std::vector<std::string>& sentences, const std::string& words) {
  return std::any_of(sentences.begin(), sentences.end(), [&](const std::string& sentence) {
    return sentence.find(words) != std::string::npos;
  });
}

TEST_F(ComediProbe, VoltsAreThoseOfTheLibrarysOwnConverters) {
  card.differential = true;
  const auto opened = open_comedi_card({.node = "/dev/comedi0",
                                        .channels = {2, 0, 1},
                                        .rate_Hz = 16'000.0,
                                        .ranges_V = {{-4.0, 4.0}, {-10.0, 10.0}, {0.0, 6.0}},
                                        .reference = "differential"});
  ASSERT_TRUE(opened) << opened.error().sentence;
  EXPECT_EQ(opened->format.period, nanoseconds{62'500});
  // The narrowest range that includes the wanted one.
  const std::vector<unsigned> ranges = {1, 0, 2};
  const std::vector<unsigned> channels = {2, 0, 1};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(card.list[i], static_cast<unsigned>(CR_PACK(channels[i], ranges[i], AREF_DIFF)));
    comedi_range range{card.ranges[ranges[i]].low, card.ranges[ranges[i]].high, UNIT_volt};
    const AnalogConversion& conversion = opened->format.conversions[i];
    for (const lsampl_t raw : {1U, 100U, 32767U, 32768U, 65534U}) {
      EXPECT_NEAR(conversion.volts(raw), comedi_to_phys(raw, &range, card.largest), 1e-12);
    }
  }
}

TEST_F(ComediProbe, ACardCalibratedByAFileIsReadByItsPolynomial) {
  const TemporaryFolder folder;
  card.soft_calibrated = true;
  EXPECT_NE(
      refusal("columns=force_V&force_N_per_V=1").find("sudo comedi_soft_calibrate -f /dev/comedi0"),
      std::string::npos);
  card.calibration_file = folder.file("fake.calibration", R"({
    driver_name => "fake", board_name => "fake-16",
    calibrations => [
      { subdevice => 3, channels => [], ranges => [0], arefs => [], caldacs => [],
        softcal_to_phys => { expansion_origin => 32768, coefficients => [1.0e-2, 3.0e-4, 2.0e-10, -1.0e-15] } } ]
  })");
  const auto opened = open_comedi_card({.node = "/dev/comedi0", .channels = {0}});
  ASSERT_TRUE(opened) << opened.error().sentence;
  const AnalogConversion& conversion = opened->format.conversions[0];
  comedi_polynomial_t polynomial{
      .coefficients = {0.01, 3e-4, 2e-10, -1e-15}, .expansion_origin = 32768, .order = 3};
  for (const lsampl_t raw : {0U, 1000U, 32768U, 65535U}) {
    EXPECT_NEAR(conversion.volts(raw), comedi_to_physical(raw, &polynomial), 1e-12) << raw;
  }
}

TEST_F(ComediProbe, VoltsBecomeForceAndDepthByTheirFactors) {
  const auto probe = open(
      "channels=3,5&columns=force_V,depth_mV&force_N_per_V=0.25&depth_um_per_mV=2&range=0:10&"
      "rate_hz=1000");
  ASSERT_TRUE(probe) << probe.error().sentence;
  EXPECT_EQ((*probe)->info().channels, ProbeSample::kForce | ProbeSample::kDepth);
  Readings readings = (*probe)->readings();
  std::size_t count = 0;
  while (count < 100) {
    ASSERT_TRUE((*probe)->read(readings, milliseconds{10}));
    for (std::size_t i = 0; i < readings.size(); ++i, ++count) {
      const ProbeSample sample = *readings.sample(i);
      const double raw = sample.force_mN / 250.0 * 65535.0 / 10.0;
      EXPECT_NEAR(raw, std::round(raw), 1e-6);
      EXPECT_NEAR(sample.depth_mm, 2.0 * (raw + 200.0) * 10.0 / 65535.0, 1e-9);
    }
  }
}

TEST_F(ComediProbe, AChannelIsASyncLineFromALevelOn) {
  card.largest = 101;  // a sawtooth of 100 scans
  const auto probe =
      open("columns=force_V,sync&force_N_per_V=1&range=0:10&rate_hz=1000&sync=sync:5");
  ASSERT_TRUE(probe) << probe.error().sentence;
  Readings readings = (*probe)->readings();
  std::vector<std::uint16_t> levels;
  for (std::size_t count = 0; count < 1000; count += readings.size()) {
    ASSERT_TRUE((*probe)->read(readings, milliseconds{10}));
    for (const SyncEdge& edge : readings.edges()) {
      EXPECT_EQ(edge.line, 1U);
      levels.push_back(edge.level);
    }
  }
  ASSERT_NEAR(static_cast<double>(levels.size()), 20.0, 2.0);
  for (std::size_t i = 1; i < levels.size(); ++i) EXPECT_NE(levels[i], levels[i - 1]);
}

// A TTL line on a range of 5 V is always at an end of it.
TEST(AnalogScans, ASyncLineAtAnEndOfTheRangeSaturatesNothing) {
  AnalogFormat format{.columns = *csv_columns_named("force_mN,sync", ','),
                      .conversions = {{.coefficients = {0.0, 1.0}, .largest = 1000},
                                      {.coefficients = {0.0, 0.005}, .largest = 1000}},
                      .sample_bytes = 2,
                      .period = milliseconds{1}};
  const auto scans = make_analog_scans(std::move(format));
  DeviceStream stream;
  for (const int sync : {1000, 0}) {
    for (const int force : {500, 1000}) {
      std::vector<std::uint8_t> bytes;
      for (const int raw : {force, sync}) {
        bytes.push_back(static_cast<std::uint8_t>(raw & 0xFFU));
        bytes.push_back(static_cast<std::uint8_t>(raw >> 8U));
      }
      scans->take(bytes, nanoseconds{0}, stream);
      EXPECT_EQ(stream.readings.back().saturated, force == 1000) << force << " " << sync;
    }
  }
}

// Two minutes of 20 kHz on eight channels, read in the kernel's portions, by a clock that is 40 ppm
// fast.
TEST_F(ComediProbe, EveryScanArrivesOnceAndInItsPlace) {
  card.drift = 40e-6;
  const auto probe = in_virtual_time(
      {.node = "/dev/comedi0", .channels = {0, 1, 2, 3, 4, 5, 6, 7}, .rate_Hz = 20'000.0});
  EXPECT_EQ(probe->info().period, microseconds{50});
  Readings readings = probe->readings();
  std::uint64_t count = 0;
  std::uint64_t first = 0;
  double worst_us = 0.0;
  const nanoseconds begin = card.clock.time;
  while (card.clock.time < begin + seconds{120}) {
    const auto read = probe->read(readings, milliseconds{10});
    ASSERT_TRUE(read);
    for (std::size_t i = 0; i < *read; ++i, ++count) {
      const ProbeSample sample = *readings.sample(i);
      if (count == 0) {
        while (card.value(first, 0) != std::lround(sample.force_mN)) ++first;
      }
      ASSERT_EQ(std::lround(sample.force_mN), card.value(first + count, 0)) << count;
      for (unsigned channel = 1; channel < 8; ++channel) {
        ASSERT_EQ(std::lround(1e3 * readings.further(i)[channel - 1]),
                  card.value(first + count, channel));
      }
      // A scan is due at its number times the period, by the card's clock.
      const double due_ns = 50'000.0 * static_cast<double>(first + count + 1) / (1.0 + card.drift);
      const double error_us =
          1e-3 * (static_cast<double>((sample.time - seconds{1000}).count()) - due_ns);
      if (card.clock.time > begin + seconds{10}) worst_us = std::max(worst_us, std::fabs(error_us));
    }
  }
  EXPECT_NEAR(static_cast<double>(count), 120.0 * 20e3, 250.0);
  EXPECT_EQ(probe->device_counts()->lost, 0U);
  EXPECT_EQ(probe->device_counts()->overruns, 0U);
  EXPECT_NEAR(probe->device_counts()->drift_ppm, 40.0, 1.0);
  // Read once a millisecond: the freshest scan of a second is younger than 50 µs.
  EXPECT_LT(worst_us, 100.0);
}

TEST_F(ComediProbe, AStallOfTheHostThatTheBufferHoldsChangesNoTime) {
  card.drift = -30e-6;
  card.buffer = 1 << 20;
  card.read_time = milliseconds{2};
  const auto probe =
      in_virtual_time({.node = "/dev/comedi0", .channels = {0, 1}, .rate_Hz = 10'000.0});
  Listened heard = listen_for(*probe, card.clock, seconds{20});
  card.clock.time += seconds{10};
  const Listened after = listen_for(*probe, card.clock, seconds{20});
  EXPECT_EQ(after.notices, std::vector<std::string>{});
  heard.samples.insert(heard.samples.end(), after.samples.begin(), after.samples.end());
  EXPECT_NEAR(static_cast<double>(heard.samples.size()), 500e3, 200.0);
  for (std::size_t i = 1; i < heard.samples.size(); ++i) {
    ASSERT_EQ(heard.samples[i].sequence, heard.samples[i - 1].sequence + 1);
    ASSERT_NEAR(
        1e-3 * static_cast<double>((heard.samples[i].time - heard.samples[i - 1].time).count()),
        100.0, 11.0);
  }
  const double length_ms = units::ms_from(heard.samples.back().time - heard.samples.front().time);
  EXPECT_NEAR(length_ms, 0.1 * static_cast<double>(heard.samples.size() - 1) * (1.0 + 30e-6), 0.3);
}

TEST_F(ComediProbe, AnOverrunIsCountedAndTheScansBeginAnew) {
  card.largest_buffer = card.buffer = 1 << 14;
  const auto probe =
      in_virtual_time({.node = "/dev/comedi0", .channels = {0, 1}, .rate_Hz = 10'000.0});
  Listened before = listen_for(*probe, card.clock, seconds{3});
  card.clock.time += seconds{1};  // 10000 scans; 4096 fit
  const Listened after = listen_for(*probe, card.clock, seconds{3});
  EXPECT_EQ(card.commands, 2);
  EXPECT_EQ(card.opened, 1);
  EXPECT_TRUE(any_has(after.notices, "its buffer was full")) << after.notices.size();
  const DeviceCounts counts = *probe->device_counts();
  EXPECT_EQ(counts.overruns, 1U);
  EXPECT_EQ(counts.outages, 0U);
  // The scans that fitted arrive; the rest is counted, to the few of the restart.
  before.samples.insert(before.samples.end(), after.samples.begin(), after.samples.end());
  const std::vector<ProbeSample>& all = before.samples;
  std::vector<std::size_t> gaps;
  for (std::size_t i = 1; i < all.size(); ++i) {
    EXPECT_LT(all[i - 1].time, all[i].time);
    if (all[i].sequence != all[i - 1].sequence + 1) gaps.push_back(i);
  }
  ASSERT_EQ(gaps.size(), 1U);
  const double missing = all[gaps[0]].force_mN - all[gaps[0] - 1].force_mN - 1.0;
  EXPECT_NEAR(missing, 10'000.0 - 4096.0, 50.0);
  EXPECT_NEAR(static_cast<double>(counts.lost), missing, 30.0);
  EXPECT_EQ(all[gaps[0]].sequence - all[gaps[0] - 1].sequence - 1, counts.lost);
  EXPECT_NEAR(units::ms_from(all[gaps[0]].time - all[gaps[0] - 1].time), 0.1 * (missing + 1.0),
              3.0);
}

TEST_F(ComediProbe, DoctorReportsRateJitterLossesAndTheTimeOfARead) {
  card.drift = 60e-6;
  card.largest_buffer = card.buffer = 1 << 14;
  MeasuredProbe probe(
      in_virtual_time({.node = "/dev/comedi0", .channels = {0, 1}, .rate_Hz = 10'000.0}));
  ASSERT_TRUE(ProbeReport::measure(probe, 3.0, card.clock));
  card.clock.time += seconds{1};  // 10000 scans; 4096 fit
  const auto report = ProbeReport::measure(probe, 9.0, card.clock);
  ASSERT_TRUE(report) << report.error().sentence;
  const Json json = report->json();
  EXPECT_NEAR(json["rate_hz"], 10'000.0, 5.0);
  EXPECT_LT(json["jitter_ms"], 2.0);
  EXPECT_EQ(json["device"]["overruns"], 1);
  EXPECT_NEAR(json["device"]["lost"], 10'000.0 - 4096.0, 80.0);
  EXPECT_NEAR(json["device"]["drift_ppm"], 60.0, 5.0);
  EXPECT_GT(json["read"]["count"], 1000);
  EXPECT_GT(json["read"]["p50_us"], 0.0);
  EXPECT_GE(json["seconds"], 8);
  const std::string text = report->text();
  for (const std::string words :
       {" samples/s with ", " lost, 0 damaged", "its buffer was full 1 time", "its clock: +",
        " ppm", "processor time of each: p50", "drift at rest: "}) {
    EXPECT_TRUE(has(text, words)) << words << text;
  }
}

TEST_F(ComediProbe, AnUnpluggedCardIsOpenedAgain) {
  const auto probe = in_virtual_time({.node = "/dev/comedi0", .channels = {0}, .rate_Hz = 1e4});
  static_cast<void>(listen_for(*probe, card.clock, seconds{2}));
  card.unplugged = true;
  const Listened out = listen_for(*probe, card.clock, seconds{2});
  EXPECT_TRUE(any_has(out.notices, "is disconnected: the press is released"));
  EXPECT_FALSE(probe->status().connected);
  card.unplugged = false;
  const Listened back = listen_for(*probe, card.clock, seconds{2});
  EXPECT_TRUE(any_has(back.notices, "is back after"));
  EXPECT_EQ(card.opened, 2);
  ASSERT_GT(back.samples.size(), 10'000U);
  EXPECT_EQ(probe->device_counts()->outages, 1U);
  for (std::size_t i = 1; i < back.samples.size(); ++i) {
    ASSERT_EQ(back.samples[i].sequence, back.samples[i - 1].sequence + 1);
  }
  EXPECT_NEAR(units::ms_from(back.samples.back().time - back.samples.front().time),
              0.1 * static_cast<double>(back.samples.size() - 1), 2.0);
}

TEST_F(ComediProbe, ACardWhoseScansEndAtOnceIsGone) {
  auto opened = open_comedi_card({.node = "/dev/comedi0", .channels = {0}});
  ASSERT_TRUE(opened);
  card.ends_at_once = true;
  std::vector<std::uint8_t> bytes(64);
  int restarts = 0;
  while (opened->port->read(bytes, milliseconds{1})) ++restarts;
  EXPECT_EQ(restarts, 8);
  EXPECT_FALSE(opened->port->read(bytes, milliseconds{1}));
  EXPECT_FALSE(opened->port->write(bytes));
  card.ends_at_once = false;
  EXPECT_TRUE(opened->port->reopen());
}

TEST_F(ComediProbe, ABufferOfFiveSecondsIsRequestedUpToWhatTheCardMay) {
  ASSERT_TRUE(open_comedi_card({.node = "/dev/comedi0", .channels = {0, 1}, .rate_Hz = 10'000.0}));
  EXPECT_EQ(card.buffer, 200'000);
  ASSERT_TRUE(open_comedi_card(
      {.node = "/dev/comedi0", .channels = {0, 1, 2, 3, 4, 5, 6, 7}, .rate_Hz = 20'000.0}));
  EXPECT_EQ(card.buffer, 1 << 20);
}

TEST_F(ComediProbe, LongSamplesAndTheEndsOfARangeAreRead) {
  card.long_samples = true;
  card.largest = (1U << 24U) - 1;
  const auto opened = open_comedi_card({.node = "/dev/comedi0", .channels = {0}});
  ASSERT_TRUE(opened);
  EXPECT_EQ(opened->format.sample_bytes, 4U);
  const auto protocol =
      make_analog_scans({.columns = {*csv_column_named("force_mN")},
                         .conversions = {{.coefficients = {-1e-3, 1e-3},
                                          .largest = opened->format.conversions[0].largest}},
                         .sample_bytes = 4,
                         .period = opened->format.period});
  DeviceStream stream;
  protocol->begin({}, stream);
  const Bytes bytes = {0, 0, 0, 0, 0x39, 0x30, 0, 0, 0xFF, 0xFF, 0xFF, 0};
  // In any portions.
  for (const std::uint8_t byte : bytes) protocol->take({&byte, 1}, seconds{1}, stream);
  ASSERT_EQ(stream.readings.size(), 3U);
  EXPECT_TRUE(stream.readings[0].saturated);
  EXPECT_FALSE(stream.readings[1].saturated);
  EXPECT_NEAR(stream.readings[1][DeviceChannel::kForce], 12.344e-3, 1e-12);
  EXPECT_TRUE(stream.readings[2].saturated);
  EXPECT_EQ(stream.readings[2].device_time, 2 * opened->format.period);
  EXPECT_EQ(stream.counts.bytes, 12U);
  EXPECT_FALSE(stream.readings[0].rebooted);
  // A card that starts anew counts from 0, also after a single scan.
  for (int start = 0; start < 2; ++start) {
    protocol->begin({}, stream);
    protocol->take(std::span(bytes).first(4), seconds{1}, stream);
    EXPECT_TRUE(stream.readings.back().rebooted);
    EXPECT_EQ(stream.readings.back().device_time, nanoseconds{0});
  }
}

TEST_F(ComediProbe, WhatTheCardCannotDoIsRefusedWithTheRemedy) {
  const auto expect = [&](const std::string& options, const std::string& words) {
    const std::string sentence = refusal(options);
    EXPECT_NE(sentence.find(words), std::string::npos) << sentence;
    EXPECT_EQ(sentence.find('\n'), std::string::npos);
  };
  expect("rate_hz=10000", "columns=force_V");
  expect("columns=force_V&force_N_per_V=1&reference=differential", "set reference=ground");
  expect("columns=force_V&force_N_per_V=1&channels=8", "has no channel 8: its channels are 0 to 7");
  expect("columns=force_V&force_N_per_V=1&channels=0,1", "one number for each of the 1 columns");
  expect("columns=force_V&force_N_per_V=1&channels=x", "such as 0,1");
  expect("columns=force_V&force_N_per_V=1&channels=-1", "such as 0,1");
  expect("columns=force_V&force_N_per_V=1&range=20", "set range= to one of -10:10, -5:5, 0:10");
  expect("columns=force_V&force_N_per_V=1&range=5:5", "such as -5:5");
  expect("columns=force_V&force_N_per_V=1&range=1,2,3", "such as -5:5");
  expect("columns=force_N",
         "a card measures volts, not force_N: write force_V, and add force_N_per_V");
  expect("columns=taxel_kPa", "write taxel_V, and add taxel_kPa_per_V");
  expect("columns=time_us,force_V&force_N_per_V=1",
         "write - for time_us, or leave out its channel");
  expect("columns=force_V", "force_N_per_V");
  expect("columns=force_V&force_N_per_V=1&rates_hz=5", "rates_hz");
  card.shortest_period_ns = 100'000;
  expect("columns=force_V,depth_V&force_N_per_V=1&depth_mm_per_V=1&rate_hz=10000",
         "the nearest is rate_hz=5000");
  EXPECT_TRUE(
      open("columns=force_V,depth_V&force_N_per_V=1&depth_mm_per_V=1&rate_hz=5000"));  // its advice
  card.refused_at = 3;
  expect("columns=force_V&force_N_per_V=1", "refuses the command at step 3");
  card.refused_at = 0;
  card.ranges = {{0.0, 20.0, 1}};
  expect("columns=force_V&force_N_per_V=1", "does not measure volts on channel 0");
  card.ranges = {{-10.0, 10.0, 0}};
  card.command_error = EBUSY;
  expect("columns=force_V&force_N_per_V=1", "is in use by another program");
  card.command_error = EIO;
  expect("columns=force_V&force_N_per_V=1", "does not start its scans");
  card.command_error = 0;
  card.scans = false;
  expect("columns=force_V&force_N_per_V=1", "has no analog inputs that it scans by its own clock");
  card.open_error = EACCES;
  expect("columns=force_V&force_N_per_V=1", "no permission to open /dev/comedi0");
  card.open_error = 0;
  fake_comedi_card = nullptr;
  expect("columns=force_V&force_N_per_V=1", "there is no device /dev/comedi0");
}

}  // namespace
}  // namespace merkel
