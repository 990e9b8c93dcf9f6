#include <thread>

#include <gtest/gtest.h>

#include "drivers/probes/open_probe.hpp"
#include "drivers/protocols/csv_columns.hpp"
#include "tests/drivers/simulation/line_printer.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/text_has.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;

std::string uri_of(const LinePrinter& printer, const std::string& columns) {
  return "serial:" + printer.name() + "?protocol=csv&columns=" + columns;
}

/// Reads until there are `count` readings.
Readings read_from(Probe& probe, std::size_t count, std::vector<std::string>* notices = nullptr) {
  Readings all = probe.readings();
  Readings some = probe.readings(64);
  for (int reads = 0; reads < 2000 && all.size() < count; ++reads) {
    const auto read = probe.read(some, milliseconds{10});
    EXPECT_TRUE(read.has_value());
    if (!read) break;
    all.add(some, 0, some.size());
    for (std::string& sentence : probe.take_notices()) {
      if (notices != nullptr) notices->push_back(std::move(sentence));
    }
  }
  EXPECT_GE(all.size(), count);
  return all;
}

DeviceUri device_of(const std::string& uri, const std::vector<std::string>& parts) {
  DeviceUri device{.uri = uri};
  for (const std::string& part : parts) device.parts.push_back(*ChannelSelection::parse(part));
  return device;
}

TEST(DeviceOutputs, OneReadingFeedsEveryProbeAtTheSameTime) {
  const LinePrinter printer("7, 200, 0.5, 1.25, 3");
  auto probe = open_device(device_of(uri_of(printer, "-,thumb_g,index_N,index_mm,seq2_mm"),
                                     {"thumb_g", "force=index_N,depth=4", "index_mm"}));
  ASSERT_TRUE(probe) << probe.error().sentence;
  const auto outputs = (*probe)->outputs();
  ASSERT_EQ(outputs.size(), 3U);
  EXPECT_EQ(outputs[0].channels, ProbeSample::kForce);
  EXPECT_EQ(outputs[1].channels, ProbeSample::kForce | ProbeSample::kDepth);
  EXPECT_EQ(outputs[2].channels, ProbeSample::kDepth);
  EXPECT_TRUE(outputs[1].uri.ends_with("#depth=4,force=index_N"));
  const Readings readings = read_from(**probe, 10);
  for (std::size_t i = 0; i < readings.size(); ++i) {
    for (std::size_t k = 0; k < outputs.size(); ++k) {
      EXPECT_EQ(readings.sample(i, k)->channels, outputs[k].channels);
    }
    EXPECT_NEAR(readings.sample(i, 0)->force_mN, 200 * 9.80665, 1e-9);
    EXPECT_EQ(readings.sample(i, 1)->force_mN, 500.0);
    EXPECT_EQ(readings.sample(i, 1)->depth_mm, 1.25);
    EXPECT_EQ(readings.sample(i, 2)->depth_mm, 1.25);
  }
  EXPECT_LE((*probe)->device_counts()->readings, readings.size() + 1);
  EXPECT_EQ((*probe)->ports(), 1U);
}

TEST(DeviceOutputs, EachRowOfARecordingFeedsEveryProbeOnce) {
  constexpr std::size_t kRows = 1000;  // more than one read takes
  std::string rows = "time_s,force_N,index_N\n";
  for (std::size_t k = 0; k < kRows; ++k) {
    rows += "0." + std::to_string(kRows + k) + ",0.5," + std::to_string(k) + "e-3\n";
  }
  const TemporaryFolder folder;
  const auto probe =
      open_device(device_of("replay:" + folder.file("t.csv", rows), {"force_N", "index_N"}));
  ASSERT_TRUE(probe) << probe.error().sentence;
  const Readings readings = read_from(**probe, kRows);
  ASSERT_EQ(readings.size(), kRows);
  for (std::size_t k = 0; k < kRows; ++k) {
    EXPECT_EQ(readings.sample(k, 0)->force_mN, 500.0);
    EXPECT_NEAR(readings.sample(k, 1)->force_mN, static_cast<double>(k), 1e-9);
  }
}

TEST(DeviceOutputs, ARecordingWithoutAValueHasNoSample) {
  const TemporaryFolder folder;
  const std::string trace = folder.file(
      "t.csv", "time_s,thumb_N,index_N\n0,0.5,\n0.1,0.5,0.2\n0.2,0.5,\n0.3,0.5,2e4\n0.4,,0.2\n");
  const auto probe = open_device(device_of("replay:" + trace, {"thumb_N", "index_N"}));
  ASSERT_TRUE(probe) << probe.error().sentence;
  const Readings readings = read_from(**probe, 5);
  ASSERT_EQ(readings.size(), 5U);
  for (std::size_t k = 0; k < 5; ++k) EXPECT_EQ(readings.sample(k, 0).has_value(), k < 4) << k;
  EXPECT_EQ(readings.sample(0, 1)->force_mN, 0.0);  // nothing has touched it yet
  EXPECT_EQ(readings.sample(1, 1)->force_mN, 200.0);
  EXPECT_FALSE(readings.sample(2, 1));
  EXPECT_FALSE(readings.sample(3, 1));
  EXPECT_EQ(readings.sample(4, 1)->force_mN, 200.0);
}

TEST(DeviceOutputs, ARecordingOutsideItsCalibrationIsCountedAndNamed) {
  const TemporaryFolder folder;
  const std::string calibration =
      folder.file("c.toml",
                  "force_N_per_V = 1.0\n[force]\nsource = \"force\"\nrange = [0.0, 0.2]\n"
                  "saturation = 0.25\n");
  const std::string trace =
      folder.file("t.csv", "time_s,force_V\n0,0.1\n0.1,0.22\n0.2,0.3\n0.3,0.3\n0.4,0.1\n");
  const auto probe = open_probe("replay:" + trace + "?calibration=" + calibration);
  ASSERT_TRUE(probe) << probe.error().sentence;
  EXPECT_FALSE((*probe)->device_counts());
  std::vector<std::string> notices;
  const Readings readings = read_from(**probe, 5, &notices);
  EXPECT_EQ(readings.sample(1)->doubts(), ProbeSample::kOutsideCalibration);
  ASSERT_TRUE((*probe)->device_counts());
  EXPECT_EQ((*probe)->device_counts()->readings, 5U);
  EXPECT_EQ((*probe)->device_counts()->outside_calibration, 3U);
  EXPECT_EQ((*probe)->device_counts()->saturated, 2U);
  ASSERT_EQ(notices.size(), 2U);
  EXPECT_TRUE(has(notices[0], "outside the calibrated range of " + calibration)) << notices[0];
  EXPECT_TRUE(has(notices[1], "the sensor is at the end of its range")) << notices[1];
  // The same factor, written in another way.
  EXPECT_TRUE(open_probe("replay:" + trace + "?force_N_per_V=1.00&calibration=" + calibration));
}

TEST(DeviceOutputs, ReadingsThatACalibrationDoesNotCoverAreThoseOfTheirProbe) {
  const TemporaryFolder folder;
  const std::string calibration =
      folder.file("c.toml",
                  "index_N_per_V = 1.0\n[force]\nsource = \"index_N\"\nrange = [0.0, 0.2]\n"
                  "saturation = 0.25\n");
  const LinePrinter printer("0.5, 0.3");
  const std::string trace = folder.file("t.csv", "time_s,thumb_V,index_V\n0,0.5,0.3\n1,0.5,0.3\n");
  for (const std::string& uri :
       {uri_of(printer, "thumb_V,index_V") + "&", "replay:" + trace + "?"}) {
    DeviceUri device = device_of(uri + "thumb_N_per_V=1", {"thumb_N", "index_N"});
    device.calibrations = {"", calibration};
    const auto probe = open_device(device);
    ASSERT_TRUE(probe) << probe.error().sentence;
    static_cast<void>(read_from(**probe, 2));
    const ProbeStatus status = (*probe)->status();
    ASSERT_EQ(status.faults.size(), 2U) << uri;
    EXPECT_EQ(status.faults[0].outside_calibration + status.faults[0].saturated, 0U) << uri;
    EXPECT_EQ(status.faults[1].outside_calibration, status.device->outside_calibration) << uri;
    EXPECT_EQ(status.faults[1].saturated, status.device->saturated) << uri;
    EXPECT_GE(status.faults[1].saturated, 2U) << uri;
  }
}

TEST(DeviceOutputs, ChannelsThatAreNotKeptAreReported) {
  const LinePrinter printer(
      "1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17,18,19,20,21,22,23,24,25,26,27,28,29,30,31,32,33,"
      "34,35,36");
  auto probe = open_device({
      .uri = uri_of(printer, "taxel_Pa*36"),
  });
  ASSERT_TRUE(probe) << probe.error().sentence;
  EXPECT_EQ((*probe)->info().extra_columns.size(), ProbeColumns::kMaxFurther);
  EXPECT_EQ((*probe)->info().extra_columns.front(), "taxel1_kPa");
  const auto notices = (*probe)->take_notices();
  ASSERT_EQ(notices.size(), 1U);
  EXPECT_TRUE(has(notices[0], "36 channels, of which only the first 32 are kept")) << notices[0];
  // Follows the advice.
  EXPECT_TRUE(has(notices[0], "#taxels=36")) << notices[0];
  probe->reset();
  const auto array = open_device(device_of(uri_of(printer, "taxel_Pa*36"), {"taxels=36"}));
  ASSERT_TRUE(array) << array.error().sentence;
  EXPECT_EQ((*array)->info().taxels, 36U);
}

TEST(DeviceOutputs, AHeaderNamesTheChannels) {
  const LinePrinter printer("12,0.5,0.25", 115200, {.header = "time_ms,thumb (N),index (N)"});
  const auto probe = open_probe("serial:" + printer.name() + "?protocol=csv#index");
  ASSERT_TRUE(probe) << probe.error().sentence;
  EXPECT_EQ(read_from(**probe, 5).sample(4)->force_mN, 250.0);
}

TEST(DeviceOutputs, LabelsInTheLinesNameTheChannels) {
  const LinePrinter printer("thumb: 0.5 N, index: 0.25 N");
  const auto probe = open_probe("serial:" + printer.name() + "?protocol=csv#index");
  ASSERT_TRUE(probe) << probe.error().sentence;
  EXPECT_EQ(read_from(**probe, 5).sample(4)->force_mN, 250.0);
}

TEST(DeviceOutputs, WithoutAChoiceTheChannelsAreFurtherColumns) {
  const LinePrinter printer("0.5, 0.25");
  const auto probe = open_probe(uri_of(printer, "force_N,index_N"));
  ASSERT_TRUE(probe) << probe.error().sentence;
  EXPECT_EQ((*probe)->info().extra_columns, std::vector<std::string>{"index_N"});
  const Readings readings = read_from(**probe, 5);
  EXPECT_EQ(readings.sample(4)->force_mN, 500.0);
  EXPECT_EQ(readings.further(4)[0], 0.25);
}

TEST(DeviceOutputs, ASensorWithoutAValueReleasesOnlyItsProbe) {
  LinePrinter printer("0.5, 0.25");
  auto probe = open_device(device_of(uri_of(printer, "thumb_N,index_N"), {"1", "2"}));
  ASSERT_TRUE(probe) << probe.error().sentence;
  static_cast<void>(read_from(**probe, 20));
  printer.print("0.5, nan");
  std::vector<std::string> notices;
  const Readings readings = read_from(**probe, 200, &notices);
  for (std::size_t i = 20; i < readings.size(); ++i) {
    EXPECT_TRUE(readings.sample(i, 0)) << i;
    EXPECT_FALSE(readings.sample(i, 1)) << i;
  }
  ASSERT_EQ(notices.size(), 1U);
  EXPECT_TRUE(has(notices[0], ", index_N has no value")) << notices[0];
  EXPECT_EQ((*probe)->device_counts()->distrusted, 0U);
}

TEST(DeviceOutputs, EachIsTaredByItself) {
  LinePrinter printer("0.0625, 0.03125");
  auto probe = open_device(device_of(uri_of(printer, "thumb_N,index_N"), {"thumb", "index"}));
  ASSERT_TRUE(probe) << probe.error().sentence;
  EXPECT_TRUE((*probe)->request_tare(1));
  static_cast<void>(read_from(**probe, 80));
  printer.print("0.5, 0.5");
  const Readings readings = read_from(**probe, 60);
  EXPECT_EQ(readings.sample(readings.size() - 1, 0)->force_mN, 500.0);
  EXPECT_EQ(readings.sample(readings.size() - 1, 1)->force_mN, 468.75);
}

TEST(DeviceOutputs, RefusalsNameTheChannels) {
  const LinePrinter printer("0.5, 0.25, 3");
  const auto refusal = [&](const std::string& columns, const std::string& part) {
    const auto probe = open_probe(uri_of(printer, columns) + "#" + part);
    return probe ? std::string() : probe.error().sentence;
  };
  EXPECT_TRUE(has(refusal("a_N,b_N,c_mm", "d"), "The device has a_N, b_N, c_mm"));
  EXPECT_TRUE(has(refusal("a_N,b_N,-", "3"), "column 3 is no force and no length"));
  EXPECT_TRUE(has(refusal("a_N,b_N,c_mm", "force=c"), "is a length and cannot be the force"));
  EXPECT_TRUE(has(refusal("a_N,a_mm,-", "a"), "name one with its unit"));
  EXPECT_TRUE(has(refusal("a_N,b_N,-", "a,b"), "the force is chosen twice"));
  EXPECT_TRUE(has(refusal("a_N,b_N,-", "weight=a"), "must be force, depth, x or y"));
  EXPECT_TRUE(has(refusal("force_N,force_N,-", "1"), "named twice"));
}

TEST(DeviceOutputs, ChannelsAreReadAsTheyAreWritten) {
  for (const char* const text : {"force=thumb_N,x=2", "thumb_N", "depth=1,force=2,x=3,y=4"}) {
    const auto channels = ChannelSelection::parse(text);
    ASSERT_TRUE(channels) << channels.error();
    EXPECT_EQ(ChannelSelection::parse(channels->text())->of, channels->of);
    EXPECT_EQ(ChannelSelection::parse(channels->text())->by_unit, channels->by_unit);
  }
  EXPECT_EQ(DeviceUri::parse("serial:/dev/x?protocol=csv#thumb_N")->parts.size(), 1U);
  for (const char* const whole : {"replay:run#2.csv", "replay:a#b/t.csv", "fused:a:b#c|d:e"}) {
    EXPECT_EQ(split_fragment(whole).first, whole);
  }
}

TEST(DeviceOutputs, AHeaderIsOneOnlyWithSeveralNamesOrAKnownQuantity) {
  EXPECT_EQ(csv_columns_of_header(csv_cells_of("time_us,seq,thumb_N,index_N,palm_N", ',')),
            (std::vector<std::string>{"time_us", "seq", "thumb_N", "index_N", "palm_N"}));
  EXPECT_EQ(csv_columns_of_header(csv_cells_of("Force (N),Force (N)", ',')),
            (std::vector<std::string>{"force_N", "force2_N"}));
  EXPECT_EQ(csv_columns_of_header(csv_cells_of("t1 (kPa),t2 [psi],note", ',')),
            (std::vector<std::string>{"t1_kPa", "t2_psi", "-"}));
  EXPECT_TRUE(csv_columns_of_header(csv_cells_of("calibrated (g)", ',')).empty());
  EXPECT_TRUE(csv_columns_of_header(csv_cells_of("HX711 ready, gain 128 (g)", ',')).empty());
}

}  // namespace
}  // namespace merkel
