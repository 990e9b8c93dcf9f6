#include "drivers/spike_files/pulse_file.hpp"

#include <cstring>
#include <filesystem>

#include <gtest/gtest.h>

#include "drivers/files/npy_file.hpp"
#include "drivers/files/raw_bytes.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/text_has.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using Times = std::vector<nanoseconds>;

/// A NumPy file as NumPy writes it.
template <class Number>
void write_npy(const std::string& path, const char* type, const std::vector<Number>& numbers) {
  std::string header = std::string("{'descr': '") + type + "', 'fortran_order': False, 'shape': (" +
                       std::to_string(numbers.size()) + ",), }";
  header.resize(117, ' ');
  std::string bytes("\x93NUMPY\x01\x00", 8);
  append_raw(bytes, static_cast<std::uint16_t>(header.size() + 1));
  bytes += header + '\n';
  for (const Number number : numbers) append_raw(bytes, number);
  std::ofstream(path, std::ios::binary) << bytes;
}

TEST(PulseFile, ReadsSpikeGlxsEdgeFilesAndOtherTimesInAnyUnit) {
  const TemporaryFolder folder;
  const auto glx = read_pulse_file(folder.file("run.imec0.ap.xd_384_6_500.txt", "0.5\n1.25\n"));
  ASSERT_TRUE(glx) << glx.error().sentence;
  EXPECT_EQ(glx->lines.at(1), (Times{milliseconds{500}, milliseconds{1250}}));
  const auto csv =
      read_pulse_file(folder.file("a.csv", "# a note\ntime_ms,level\n2.5,1\n1.5,1\n1.5,1\n"));
  ASSERT_TRUE(csv) << csv.error().sentence;
  EXPECT_EQ(csv->lines.at(1), (Times{microseconds{1500}, microseconds{2500}}));
}

TEST(PulseFile, OfRowsWithALevelTheRisingEdgesArePulses) {
  const TemporaryFolder folder;
  const auto edges = read_pulse_file(folder.file(
      "edges.csv",
      "time_s,probe,line,level\n88554.283959401,0,1,1\n88554.298024401,0,1,0\n88555,0,2,1\n"));
  ASSERT_TRUE(edges) << edges.error().sentence;
  EXPECT_EQ(edges->lines.size(), 2U);
  EXPECT_EQ(edges->lines.at(1), Times{nanoseconds{88'554'283'959'401}});
  EXPECT_EQ(edges->lines.at(2), Times{milliseconds{88'555'000}});
  for (const std::string row : {"1,0,1", "1,0,1,5", "1,0,70000,1", "1,0,,1"}) {
    const auto wrong =
        read_pulse_file(folder.file("wrong.csv", "time_s,probe,line,level\n" + row + "\n"));
    ASSERT_FALSE(wrong) << row;
    EXPECT_TRUE(has(wrong.error().sentence, "wrong.csv:2: its l")) << wrong.error().sentence;
  }
}

TEST(PulseFile, ReadsTheRisingEdgesOfEachLineOfOpenEphys) {
  const TemporaryFolder folder;
  const std::string name = "Record Node 101/experiment1/recording1/events/Board.0/TTL";
  std::filesystem::create_directories(folder.path(name));
  write_npy<std::int16_t>(folder.path(name + "/states.npy"), "<i2", {1, 3, -1, 1, -3, -1});
  write_npy<double>(folder.path(name + "/timestamps.npy"), "<f8", {10.0, 10.1, 10.2, 11, 11.1, 12});
  write_npy<std::int64_t>(folder.path(name + "/sample_numbers.npy"), "<i8",
                          {300'000, 303'000, 306'000, 330'000, 333'000, 360'000});
  const auto by_time = read_pulse_file(folder.path(name));
  ASSERT_TRUE(by_time) << by_time.error().sentence;
  EXPECT_EQ(by_time->lines.at(1), (Times{milliseconds{10'000}, milliseconds{11'000}}));
  EXPECT_EQ(by_time->lines.at(3), Times{milliseconds{10'100}});
  const auto without_rate = read_pulse_file(folder.path(name + "/sample_numbers.npy"));
  ASSERT_FALSE(without_rate);
  EXPECT_TRUE(has(without_rate.error().sentence, "structure.oebin"));
  static_cast<void>(folder.file(
      "Record Node 101/experiment1/recording1/structure.oebin",
      R"({"continuous": [], "events": [{"folder_name": "Other/TTL/", "sample_rate": 1.0},
          {"folder_name": "Board.0/TTL/", "sample_rate": 30000.0}]})"));
  const auto by_sample = read_pulse_file(folder.path(name + "/sample_numbers.npy"));
  ASSERT_TRUE(by_sample) << by_sample.error().sentence;
  EXPECT_EQ(by_sample->lines, by_time->lines);
}

TEST(PulseFile, SaysWhatIsWrongAndWhere) {
  const TemporaryFolder folder;
  const auto text = read_pulse_file(folder.file("a.csv", "time_s\n1.0\nhigh\n"));
  ASSERT_FALSE(text);
  EXPECT_TRUE(has(text.error().sentence, "a.csv:3: this is not the time of a pulse"));
  EXPECT_FALSE(read_pulse_file(folder.file("b.csv", "1e300\n")));
  EXPECT_FALSE(read_pulse_file(folder.path("missing.txt")));
  std::filesystem::create_directory(folder.path("TTL"));
  EXPECT_TRUE(has(read_pulse_file(folder.path("TTL")).error().sentence, "channel_states.npy"));
  write_npy<std::int16_t>(folder.path("TTL/states.npy"), "<i2", {1, -1});
  write_npy<double>(folder.path("TTL/timestamps.npy"), "<f8", {10.0});
  EXPECT_TRUE(has(read_pulse_file(folder.path("TTL")).error().sentence, "has 1 values, but"));
}

}  // namespace
}  // namespace merkel
