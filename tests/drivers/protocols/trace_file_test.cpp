#include "drivers/protocols/trace_file.hpp"

#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "core/math/random.hpp"
#include "drivers/sinks/open_sink.hpp"
#include "tests/temporary_folder.hpp"

namespace merkel {
namespace {

/// All samples of a trace, or the error.
Expected<std::vector<ProbeSample>, SetupError> read_all(const std::string& path,
                                                        std::size_t at_once = 7) {
  auto reader = TraceReader::open(path);
  if (!reader) return Unexpected<SetupError>(reader.error());
  std::vector<ProbeSample> all;
  std::vector<ProbeSample> some(at_once);
  for (;;) {
    const auto count = reader->read(some);
    if (!count) return Unexpected<SetupError>(count.error());
    if (*count == 0) return all;
    all.insert(all.end(), some.begin(), some.begin() + static_cast<std::ptrdiff_t>(*count));
  }
}

std::string sentence_about(const std::string& content) {
  const TemporaryFolder folder;
  const auto result = read_all(folder.file("t.csv", content));
  return result ? "accepted" : result.error().sentence.substr(folder.path("").size());
}

TEST(TraceReader, ReadsColumnsInAnyOrderWithCommentsAndBlanks) {
  const TemporaryFolder folder;
  const auto samples =
      read_all(folder.file("t.csv",
                           "# made by hand\n\nx_mm, depth_mm ,time_s,y_mm\n 1,2,0.5, 3\n"
                           "# between\n1.5,-2,0.501,3\n"));
  ASSERT_TRUE(samples) << samples.error().sentence;
  ASSERT_EQ(samples->size(), 2U);
  EXPECT_EQ((*samples)[0].time, std::chrono::milliseconds{500});
  EXPECT_EQ((*samples)[0].depth_mm, 2.0);
  EXPECT_EQ((*samples)[0].x_mm, 1.0);
  EXPECT_EQ((*samples)[0].y_mm, 3.0);
  EXPECT_EQ((*samples)[1].depth_mm, -2.0);
  EXPECT_EQ((*samples)[1].sequence, 1U);
  EXPECT_FALSE((*samples)[0].has(ProbeSample::kForce));
}

TEST(TraceReader, TakesAValidityThatIsATime) {
  const TemporaryFolder folder;
  const auto samples = read_all(folder.file(
      "t.csv",
      "time_s,depth_mm\n0,1\n# valid_for_s=0.25\n1,1\n# valid_for_s=-1\n2,1\n# valid_for_s=x\n3,1\n"
      "# valid_for_s=0\n4,1\n"));
  ASSERT_TRUE(samples) << samples.error().sentence;
  ASSERT_EQ(samples->size(), 5U);
  constexpr int kExpected_ms[] = {250, 250, 250, 0};
  EXPECT_EQ((*samples)[0].valid_for, SampleSource::kNotStated);
  for (std::size_t i = 1; i < samples->size(); ++i) {
    EXPECT_EQ((*samples)[i].valid_for, std::chrono::milliseconds{kExpected_ms[i - 1]}) << i;
  }
}

TEST(TraceReader, TakesForcesInNewtons) {
  const TemporaryFolder folder;
  const auto samples = read_all(folder.file("t.csv", "time_s,force_N\n0,0.25\n"));
  ASSERT_TRUE(samples);
  EXPECT_EQ((*samples)[0].force_mN, 250.0);
  EXPECT_TRUE((*samples)[0].has(ProbeSample::kForce));
  EXPECT_FALSE((*samples)[0].has(ProbeSample::kDepth));
}

TEST(TraceReader, ReadsTheUnitsThatDevicesUse) {
  const TemporaryFolder folder;
  const auto samples = read_all(folder.file(
      "t.csv", "time_ms,force_g,depth_um,x_um,y_in\n0,60.0,1500,10000,0.5\n0.25,-1,100,0,0\n"));
  ASSERT_TRUE(samples) << samples.error().sentence;
  ASSERT_EQ(samples->size(), 2U);
  EXPECT_NEAR((*samples)[0].force_mN, 588.399, 1e-9);
  EXPECT_EQ((*samples)[0].depth_mm, 1.5);
  EXPECT_EQ((*samples)[0].x_mm, 10.0);
  EXPECT_DOUBLE_EQ((*samples)[0].y_mm, 12.7);
  EXPECT_EQ((*samples)[1].time, std::chrono::microseconds{250});
  const auto micro = read_all(folder.file("u.csv", "time_us,force_mN\n0,1\n1000001,250.1\n"));
  ASSERT_TRUE(micro) << micro.error().sentence;
  EXPECT_EQ((*micro)[1].time, std::chrono::microseconds{1'000'001});
  EXPECT_EQ((*micro)[1].force_mN, 250.1);
}

TEST(TraceReader, ManyPressuresAreTheTaxelsOfAnArray) {
  const TemporaryFolder folder;
  const auto header = [](int taxels) {
    std::string text = "time_s";
    for (int i = 1; i <= taxels; ++i) text += ",p" + std::to_string(i) + "_hPa";
    return text + ",humidity\n";
  };
  std::string rows;
  for (int k = 0; k < 3; ++k) {
    rows += std::to_string(k);
    for (int i = 0; i < 40; ++i) rows += "," + std::to_string(10 * i + k);
    rows += ",55\n";
  }
  auto reader = TraceReader::open(folder.file("t.csv", header(40) + rows));
  ASSERT_TRUE(reader) << reader.error().sentence;
  EXPECT_EQ(reader->taxels().size(), 40U);
  EXPECT_EQ(reader->extra_columns(), std::vector<std::string>{"humidity"});
  Readings readings(ReadingColumns(reader->columns()));
  ASSERT_EQ(reader->read(readings, 3).value_or(0), 3U);
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const auto row = readings.taxels(k);
    ASSERT_EQ(row.size(), 40U);
    EXPECT_FLOAT_EQ(static_cast<float>(row[7]), 0.1F * static_cast<float>(70 + k));
    EXPECT_EQ(readings.further(k)[0], 55.0);
  }
  EXPECT_NE(sentence_about(header(1025)).find("at most 1024 taxels"), std::string::npos);
}

TEST(TraceReader, AcceptsCrLfAByteOrderMarkAndNoFinalLineEnd) {
  const TemporaryFolder folder;
  const auto samples =
      read_all(folder.file("t.csv", "\xEF\xBB\xBFtime_s,depth_mm\r\n0,1\r\n0.001,2"));
  ASSERT_TRUE(samples) << samples.error().sentence;
  EXPECT_EQ(samples->size(), 2U);
}

TEST(TraceReader, EveryErrorHasFileLineAndRemedy) {
  EXPECT_EQ(sentence_about(""),
            "t.csv is empty: a trace begins with a header such as time_s,depth_mm");
  EXPECT_EQ(
      sentence_about("time_s,dept_mm\n"),
      "t.csv:1: a column depth_mm or force_N is missing: add the recorded one; other "
      "units are named like force_g and depth_um; the model does not use dept_mm (did you mean depth_mm?)");
  // The nearest name would be another unit, and so a wrong number.
  EXPECT_EQ(
      sentence_about("time_s,depth_yd\n"),
      "t.csv:1: a column depth_mm or force_N is missing: add the recorded one; other units are "
      "named like force_g and depth_um; the model does not use depth_yd (the unit of depth_yd is "
      "unknown: lengths are in mm, um, cm, m, in)");
  EXPECT_EQ(sentence_about("depth_mm\n1\n"),
            "t.csv:1: the column time_s is missing: add the times, in seconds (or time_ms, "
            "time_us)");
  EXPECT_EQ(sentence_about("time_s,x_mm\n"),
            "t.csv:1: a column depth_mm or force_N is missing: add the recorded one; other "
            "units are named like force_g and depth_um");
  EXPECT_EQ(sentence_about("time_s,time_s,depth_mm\n"),
            "t.csv:1: the column time_s is repeated: keep one");
  EXPECT_EQ(sentence_about("time_s,depth_mm\n0,nan\n"),
            "t.csv:2: depth_mm is \"nan\", not finite: correct or remove this row");
  EXPECT_EQ(sentence_about("time_s,depth_mm\n0,1\ninf,1\n"),
            "t.csv:3: time_s is \"inf\", not a finite time: correct or remove this row");
  EXPECT_EQ(sentence_about("time_ms,depth_mm\n0,1\n9e12,1\n"),
            "t.csv:3: time_ms is \"9e12\", beyond ±4e9 s: check its unit");
  EXPECT_EQ(sentence_about("time_s,depth_mm\n0,deep\n"),
            "t.csv:2: depth_mm is \"deep\", not a number: correct or remove this row");
  EXPECT_EQ(sentence_about("time_s,depth_mm\n1,0\n0.5,0\n"),
            "t.csv:3: time_s is \"0.5\", earlier than 1 in the previous row: sort the rows by "
            "time, or correct the wrong one");
  EXPECT_EQ(sentence_about("time_s;depth_mm\n0;1\n"),
            "t.csv:1: the columns are not separated by commas: separate them by commas, and write "
            "decimals with a point, as in 0.001,1.5");
  EXPECT_EQ(
      sentence_about("0,0\n0.001,0.5\n"),
      "t.csv:1: the first line has numbers where the columns' names belong: add a header such "
      "as time_s,depth_mm");
  EXPECT_EQ(sentence_about("time_s,depth_mm\n1,0\n1.0,0\n"),
            "t.csv:3: time_s is \"1.0\", the same time as in the previous row (resolution: 1 ns): "
            "remove one");
  EXPECT_EQ(sentence_about("time_s,depth_mm\n1\n"),
            "t.csv:2: this row has 1 field, but the header has 2: complete or remove it");
  EXPECT_EQ(sentence_about("time_s,depth_mm\n1,5000\n"),
            "t.csv:2: depth_mm is \"5000\", beyond ±1000 mm: check its unit");
}

TEST(TraceReader, RefusesWhatIsNoTable) {
  EXPECT_EQ(sentence_about(std::string("\x7f"
                                       "ELF\x02\x01\x00\x00",
                                       8)),
            "t.csv:1: this line contains the control character 0x02: this is not a CSV table");
  std::string endless = "time_s,depth_mm\n";
  endless.append(100'000, '7');
  EXPECT_NE(sentence_about(endless).find("t.csv:2: this line has more than 32768 characters"),
            std::string::npos);
  EXPECT_NE(read_all("no/such/file").error().sentence.find("cannot read no/such/file"),
            std::string::npos);
  EXPECT_NE(read_all("/tmp").error().sentence.find("is a directory"), std::string::npos);
}

TEST(TraceReader, SurvivesRandomBytes) {
  const TemporaryFolder folder;
  Random random(3);
  for (int k = 0; k < 300; ++k) {
    std::string content = k % 2 == 0 ? "time_s,depth_mm\n" : "";
    for (int i = 0; i < 400; ++i) {
      constexpr std::string_view kLikely = "0123456789.,-+eE\n\r# nai";
      content += k % 3 == 0 ? static_cast<char>(random.next() & 0xFFU)
                            : kLikely[random.next() % kLikely.size()];
    }
    const auto samples = read_all(folder.file("t.csv", content));
    if (!samples) continue;
    for (const ProbeSample& sample : *samples) EXPECT_TRUE(std::isfinite(sample.depth_mm));
  }
}

TEST(TraceReader, KnowsTheStartOfTheRunThatRecordedIt) {
  const TemporaryFolder folder;
  const auto start_of = [&](const std::string& comments, const std::string& first_s) {
    auto trace = TraceReader::open(
        folder.file("t.csv", comments + "time_s,depth_mm\n" + first_s + ",1\n9,1\n"));
    std::array<ProbeSample, 4> samples;
    EXPECT_TRUE(trace && trace->read(samples));
    return trace->start();
  };
  const std::string run = "# time_offset_ns=5000000\n# start_device_ns=5000000\n";
  EXPECT_EQ(start_of(run, "0.0007"), std::chrono::nanoseconds{0});
  EXPECT_EQ(start_of("# time_offset_ns=-1000\n# start_device_ns=500\n", "0.01"),
            std::chrono::nanoseconds{1500});
  // Without its beginning, or without an offset, a trace starts with its first sample.
  EXPECT_EQ(start_of(run, "2.5"), std::nullopt);
  EXPECT_EQ(start_of("# start_device_ns=5\n", "0"), std::nullopt);
  EXPECT_EQ(start_of("# time_offset_ns=1e9\n# start_device_ns=99999999999999999999\n", "0"),
            std::nullopt);
}

TEST(TraceSink, WritesWhatReadsBackToTheSameBits) {
  const TemporaryFolder folder;
  Random random(9);
  std::vector<ProbeSample> samples(500);
  constexpr std::uint32_t kAll =
      ProbeSample::kDepth | ProbeSample::kForce | ProbeSample::kX | ProbeSample::kY;
  std::chrono::nanoseconds time{-5'000'000'000};
  for (ProbeSample& sample : samples) {
    time += std::chrono::nanoseconds{1 + random.next() % 1'000'000'000};
    sample = {.time = time,
              .arrival = time,
              .depth_mm = random.uniform(-3.0, 3.0),
              .force_mN = random.uniform(0.0, 2e3),
              .x_mm = random.uniform(0.0, 30.0),
              .y_mm = random.uniform(0.0, 20.0),
              .channels = kAll};
  }
  SinkSetup setup{.run = {.facts = {{"command", "first"}, {"command", "second"}}}};
  setup.run.probes = {{.channels = kAll}};
  auto sink = open_sink("trace:" + folder.path("t.csv"), setup);
  ASSERT_TRUE(sink);
  std::vector<DeliveredSample> delivered;
  for (const ProbeSample& sample : samples) delivered.push_back({.sample = sample});
  ASSERT_TRUE((*sink)->write({.samples = delivered}) && (*sink)->close());
  const auto back = read_all(folder.path("t.csv"), 64);
  ASSERT_TRUE(back) << back.error().sentence;
  ASSERT_EQ(back->size(), samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    EXPECT_EQ((*back)[i].time, samples[i].time);
    EXPECT_EQ((*back)[i].depth_mm, samples[i].depth_mm);
    EXPECT_EQ((*back)[i].force_mN, samples[i].force_mN);
    EXPECT_EQ((*back)[i].x_mm, samples[i].x_mm);
    EXPECT_EQ((*back)[i].y_mm, samples[i].y_mm);
    EXPECT_EQ((*back)[i].valid_for, samples[i].valid_for);  // without limit
  }
}

}  // namespace
}  // namespace merkel
