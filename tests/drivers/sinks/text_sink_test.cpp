#include "drivers/sinks/text_sink.hpp"

#include <array>

#include <gtest/gtest.h>

#include "drivers/sinks/open_sink.hpp"
#include "tests/temporary_folder.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

constexpr std::uint32_t kTextNeurons = 20;

TEST(TextSink, WritesTimeToTheNanosecondAndNeuron) {
  const TemporaryFolder folder;
  auto sink = open_sink("csv:" + folder.path("s.csv"), kTextNeurons, false);
  ASSERT_TRUE(sink) << sink.error().sentence;
  const std::array<SpikeEvent, 2> spikes = {
      SpikeEvent{.time = nanoseconds{1'234'567'891}, .neuron = 8},
      SpikeEvent{.time = nanoseconds{2'000'000'000}, .neuron = 13}};
  EXPECT_TRUE((*sink)->write({.spikes = spikes}));
  EXPECT_EQ((*sink)->delivered(), 0U);
  EXPECT_TRUE((*sink)->flush());
  EXPECT_EQ((*sink)->delivered(), 2U);
  EXPECT_TRUE((*sink)->close());
  EXPECT_EQ(read_file(folder.path("s.csv")), "time_s,neuron\n1.234567891,8\n2.000000000,13\n");
}

TEST(TextSink, CountsFromTheRunsStartTheEpochOrAsTheProbe) {
  const TemporaryFolder folder;
  for (const auto& [zero, text] :
       {std::pair("run", "0.500000000"), std::pair("unix", "1700000000.500000000"),
        std::pair("device", "100.500000000")}) {
    const std::string path = folder.path(std::string(zero) + ".csv");
    auto sink = open_sink("csv:" + path + "?time=" + zero, kTextNeurons, false);
    ASSERT_TRUE(sink) << sink.error().sentence;
    EXPECT_TRUE((*sink)->begin(
        {.start = std::chrono::seconds{100}, .utc = std::chrono::seconds{1'700'000'000}}));
    const SpikeEvent spike{.time = std::chrono::milliseconds{100'500}, .neuron = 8};
    EXPECT_TRUE((*sink)->write({.spikes = {&spike, 1}}));
    EXPECT_TRUE((*sink)->close());
    EXPECT_EQ(read_file(path), "time_s,neuron\n" + std::string(text) + ",8\n");
  }
}

TEST(TextSink, WritesNestsGdf) {
  const TemporaryFolder folder;
  auto sink = open_sink("gdf:" + folder.path("s.gdf"), kTextNeurons, false);
  ASSERT_TRUE(sink) << sink.error().sentence;
  const std::array<SpikeEvent, 2> spikes = {
      SpikeEvent{.time = nanoseconds{-1}, .neuron = 8},
      SpikeEvent{.time = nanoseconds{2'000'000'001}, .neuron = 13}};
  EXPECT_TRUE((*sink)->write({.spikes = spikes}));
  EXPECT_EQ((*sink)->delivered(), 0U);
  EXPECT_TRUE((*sink)->close());
  EXPECT_EQ(read_file(folder.path("s.gdf")), "8\t-0.000001\n13\t2000.000001\n");
}

TEST(TextSink, CountsWhatAFullDiskHasLost) {
  auto sink = open_sink("csv:/dev/full", kTextNeurons, false);
  ASSERT_TRUE(sink);
  const std::array<SpikeEvent, 3> spikes{};
  EXPECT_TRUE((*sink)->write({.spikes = spikes}));
  const auto closed = (*sink)->close();
  ASSERT_FALSE(closed);
  EXPECT_NE(closed.error().sentence.find("No space left"), std::string::npos);
  EXPECT_EQ((*sink)->delivered(), 0U);
}

TEST(OpenSink, NamesTheSchemesItKnows) {
  EXPECT_NE(open_sink("drain:x", kTextNeurons, false).error().sentence.find("csv:FILE"),
            std::string::npos);
  EXPECT_NE(open_sink("csv:x?mode=fast", kTextNeurons, false)
                .error()
                .sentence.find("the option mode is unknown"),
            std::string::npos);
}

}  // namespace
}  // namespace merkel
