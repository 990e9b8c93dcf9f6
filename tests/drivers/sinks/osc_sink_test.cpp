#include <array>
#include <chrono>
#include <cstring>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <lo/lo.h>

#include "drivers/sinks/open_sink.hpp"
#include "tests/free_ports.hpp"

namespace merkel {
namespace {

struct Received {
  int neuron;
  std::int64_t sequence;
  double time_s;
  int patch;
  int flags;
  std::uint32_t tag_s;
};

/// liblo aligns arguments to four bytes only.
template <class T>
T value(const lo_arg* argument) {
  T copy{};
  std::memcpy(&copy, static_cast<const void*>(argument), sizeof copy);
  return copy;
}

int take(const char*, const char*, lo_arg** arguments, int, lo_message message, void* all) {
  static_cast<std::vector<Received>*>(all)->push_back(
      {value<std::int32_t>(arguments[0]), value<std::int64_t>(arguments[1]),
       value<double>(arguments[2]), value<std::int32_t>(arguments[3]),
       value<std::int32_t>(arguments[4]), lo_message_get_timestamp(message).sec});
  return 0;
}

TEST(OscSink, LiblosOwnServerGetsEverySpikeInOrder) {  // the option types=ihdii
  const lo_server server = lo_server_new(nullptr, nullptr);
  ASSERT_NE(server, nullptr);
  std::vector<Received> received;
  lo_server_add_method(server, "/merkel/spike", "ihdii", take, &received);
  auto sink = open_sink(
      "osc:127.0.0.1:" + std::to_string(lo_server_get_port(server)) + "?types=ihdii", 20, false);
  ASSERT_TRUE(sink) << sink.error().sentence;
  std::vector<SpikeEvent> spikes;
  for (std::uint32_t k = 0; k < 50; ++k) {
    spikes.push_back({.time = std::chrono::microseconds{100 * k},
                      .neuron = 1 + k % 20,
                      .flags = SpikeEvent::kInputHeld});
  }
  ASSERT_TRUE((*sink)->write({.spikes = spikes}));
  EXPECT_EQ((*sink)->delivered(), 50U);
  while (received.size() < 50 && lo_server_recv_noblock(server, 2000) > 0) {
  }
  ASSERT_EQ(received.size(), 50U);
  const auto now = std::chrono::duration_cast<std::chrono::seconds>(
      std::chrono::system_clock::now().time_since_epoch());
  for (std::size_t k = 0; k < 50; ++k) {
    EXPECT_EQ(received[k].neuron, static_cast<int>(spikes[k].neuron));
    EXPECT_EQ(received[k].sequence, static_cast<std::int64_t>(k + 1));
    EXPECT_DOUBLE_EQ(received[k].time_s, 1e-4 * static_cast<double>(k));
    EXPECT_EQ(received[k].patch, 0);
    EXPECT_EQ(received[k].flags, SpikeEvent::kInputHeld);
    EXPECT_NEAR(static_cast<double>(received[k].tag_s) - 2'208'988'800.0,
                static_cast<double>(now.count()), 600.0);
  }
  lo_server_free(server);
}

int take_whole(const char*, const char* types, lo_arg** arguments, int count, lo_message,
               void* all) {
  std::vector<std::int32_t> numbers;
  for (int i = 0; i < count; ++i) {
    EXPECT_EQ(types[i], 'i');
    numbers.push_back(value<std::int32_t>(arguments[i]));
  }
  static_cast<std::vector<std::vector<std::int32_t>>*>(all)->push_back(numbers);
  return 0;
}

// Pure Data's [oscparse] and SuperCollider know the required types of OSC 1.0 only: i, f, s, b.
TEST(OscSink, ByDefaultAllArgumentsAreOfTypeI) {
  const lo_server server = lo_server_new(nullptr, nullptr);
  ASSERT_NE(server, nullptr);
  std::vector<std::vector<std::int32_t>> received;
  lo_server_add_method(server, "/merkel/spike", "iiiiii", take_whole, &received);
  auto sink = open_sink("osc:127.0.0.1:" + std::to_string(lo_server_get_port(server)), 20, false);
  ASSERT_TRUE(sink) << sink.error().sentence;
  const std::array<SpikeEvent, 2> spikes{
      SpikeEvent{.time = std::chrono::nanoseconds{12'345'678'901}, .neuron = 7, .patch = 2},
      SpikeEvent{.time = std::chrono::nanoseconds{-1}, .neuron = 8}};
  ASSERT_TRUE((*sink)->write({.spikes = spikes}));
  while (received.size() < 2 && lo_server_recv_noblock(server, 2000) > 0) {
  }
  ASSERT_EQ(received.size(), 2U);
  EXPECT_EQ(received[0], (std::vector<std::int32_t>{7, 1, 12, 345'678'901, 2, 0}));
  EXPECT_EQ(received[1], (std::vector<std::int32_t>{8, 2, -1, 999'999'999, 0, 0}));
  lo_server_free(server);
}

TEST(OscSink, AMissingReceiverIsNoErrorAndGetsNothing) {
  auto sink = open_sink("osc:127.0.0.1:" + std::to_string(free_ports(1)[0]), 20, false);
  ASSERT_TRUE(sink);
  const std::array<SpikeEvent, 1> spikes{SpikeEvent{.neuron = 1}};
  for (int k = 0; k < 11; ++k) EXPECT_TRUE((*sink)->write({.spikes = spikes}));
  EXPECT_TRUE((*sink)->close());
  EXPECT_EQ((*sink)->delivered(), 0U);
}

TEST(OscSink, AReceiverThatStartsLateMissesNothingFromThenOn) {
  const std::string port = std::to_string(free_ports(1)[0]);
  auto sink = open_sink("osc:127.0.0.1:" + port, 20, false);
  ASSERT_TRUE(sink);
  const std::array<SpikeEvent, 1> spikes{SpikeEvent{.neuron = 1}};
  ASSERT_TRUE((*sink)->write({.spikes = spikes}));
  const lo_server server = lo_server_new(port.c_str(), nullptr);
  ASSERT_NE(server, nullptr);
  std::vector<std::vector<std::int32_t>> received;
  lo_server_add_method(server, "/merkel/spike", "iiiiii", take_whole, &received);
  for (int k = 0; k < 2; ++k) ASSERT_TRUE((*sink)->write({.spikes = spikes}));
  while (received.size() < 2 && lo_server_recv_noblock(server, 2000) > 0) {
  }
  ASSERT_EQ(received.size(), 2U);
  EXPECT_EQ(received[0][1], 2);  // the number of the spike
  EXPECT_TRUE((*sink)->close());
  EXPECT_EQ((*sink)->delivered(), 2U);
  lo_server_free(server);
}

}  // namespace
}  // namespace merkel
