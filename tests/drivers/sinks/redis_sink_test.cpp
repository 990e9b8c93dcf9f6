// The Redis sink, against a real server.
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "drivers/files/raw_bytes.hpp"
#include "drivers/sinks/open_sink.hpp"
#include "tests/drivers/sinks/sent_commands.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/text_has.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;

/// A Redis server of this test's own.
class RedisServer {
 public:
  RedisServer() {
    process_ = ::fork();
    if (process_ == 0) {
      const std::string port = std::to_string(port_);
      const std::string folder = folder_.path("");
      ::execlp("redis-server", "redis-server", "--port", port.c_str(), "--bind", "127.0.0.1",
               "--save", "", "--appendonly", "no", "--dir", folder.c_str(), "--logfile",
               "/dev/null", static_cast<char*>(nullptr));
      ::_exit(127);
    }
    for (int k = 0; k < 200 && cli("ping") != "PONG\n"; ++k) {
      std::this_thread::sleep_for(milliseconds{50});
    }
  }
  RedisServer(const RedisServer&) = delete;
  RedisServer& operator=(const RedisServer&) = delete;
  ~RedisServer() { stop(); }
  void signal(int number) const { ::kill(process_, number); }
  void stop() {
    if (process_ <= 0) return;
    signal(SIGKILL);
    ::waitpid(process_, nullptr, 0);
    process_ = 0;
  }
  /// What redis-cli prints.
  [[nodiscard]] static std::string cli(const std::string& command) {
    const std::string line =
        "redis-cli -p " + std::to_string(port()) + " --raw " + command + " 2>/dev/null";
    std::FILE* const pipe = ::popen(line.c_str(), "r");
    std::string text;
    for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) text += static_cast<char>(c);
    ::pclose(pipe);
    return text;
  }
  [[nodiscard]] static std::string uri() {
    return "redis:127.0.0.1:" + std::to_string(port()) + "?node=stimulator";
  }
  /// Another one for each program, because tests run side by side.
  static int port() { return 20000 + ::getpid() % 10000; }

 private:
  const int port_ = port();  // of this program, not of the server that it starts
  TemporaryFolder folder_;
  pid_t process_ = 0;
};

class RedisSinkTest : public testing::Test {
 protected:
  void SetUp() override {
    if (std::system("command -v redis-server redis-cli >/dev/null") != 0) {
      GTEST_SKIP() << "redis-server is not installed: tools/install_packages test";
    }
    const auto sink = open_sink("redis:127.0.0.1:1", stim_setup());
    if (!sink && sink.error().sentence.find("built without") != std::string::npos) {
      GTEST_SKIP() << sink.error().sentence;
    }
    server_ = std::make_unique<RedisServer>();
  }
  std::unique_ptr<RedisServer> server_;
};

TEST_F(RedisSinkTest, WritesTheStreamsOfANode) {
  {
    const auto sink = open_sink(RedisServer::uri(), stim_setup());
    ASSERT_TRUE(sink) << sink.error().sentence;
    ASSERT_TRUE((*sink)->begin({}));
    ASSERT_TRUE((*sink)->write({.sent = commands()}));
    ASSERT_TRUE((*sink)->close());
  }
  EXPECT_EQ(RedisServer::cli("xlen stimulator"), "1\n");
  const std::string update = RedisServer::cli("xrange stimulator - +");
  EXPECT_TRUE(has(update, "time_ns\n10000000\n")) << update;
  EXPECT_TRUE(has(update, "heartbeat\n1\n")) << update;
  EXPECT_TRUE(has(update, "amplitude_uA\n[0.3333333333333333,0]\n")) << update;
  EXPECT_TRUE(has(update, "frequency_Hz\n[55.5,0]\n")) << update;
  EXPECT_TRUE(has(update, "stop\n[\"\",\"gap\"]\n")) << update;
  const std::string pulse = RedisServer::cli("xrange stimulator_pulses - +");
  EXPECT_TRUE(has(pulse, "electrode\nE2\n")) << pulse;
  EXPECT_TRUE(has(pulse, "time_ns\n3200001\n")) << pulse;
  for (const std::string& entry : {update, pulse}) {
    EXPECT_TRUE(has(entry, "sent_monotonic_ns\n500000000\nvalid_until_ns\n560000000\n")) << entry;
  }
  const std::string state = RedisServer::cli("xrange stimulator_state - +");
  EXPECT_TRUE(has(state, "status\nNODE_STARTED\n")) << state;
  EXPECT_TRUE(has(state, "status\nNODE_READY\n")) << state;
  EXPECT_TRUE(has(state, "parameters\n{\"electrodes\":[{\"name\":\"E1\",")) << state;
  EXPECT_TRUE(has(state, "\"phase_us\":200")) << state;
  EXPECT_TRUE(has(state, "status\nNODE_SHUTDOWN\n")) << state;
}

template <class... Number>
std::string bytes_of(Number... numbers) {
  std::string bytes;
  (append_raw(bytes, numbers), ...);
  return bytes;
}

TEST_F(RedisSinkTest, SamplesSpikesAndCountsAreNumbersInTheirBytes) {
  SinkSetup setup = stim_setup();
  setup.neurons = 3;
  setup.run.probes = {{.uri = "a", .channels = ProbeSample::kDepth | ProbeSample::kForce},
                      {.uri = "b", .channels = ProbeSample::kX | ProbeSample::kY}};
  const auto sink = open_sink(RedisServer::uri(), setup);
  ASSERT_TRUE(sink) << sink.error().sentence;
  ASSERT_TRUE((*sink)->begin({.start = milliseconds{2}, .utc = {}}));
  EXPECT_TRUE(has(RedisServer::cli("xrange stimulator_state - +"), "status\nNODE_READY\n"));
  const std::int64_t ms = 1'000'000;
  const auto sample = [](std::uint32_t probe, int time_ms, double depth_mm, double force_mN) {
    return DeliveredSample{.probe = probe,
                           .sample = {.time = milliseconds{time_ms},
                                      .depth_mm = depth_mm,
                                      .force_mN = force_mN,
                                      .x_mm = 3.0,
                                      .y_mm = 4.0}};
  };
  const std::vector<DeliveredSample> samples = {sample(0, 3, 0.25, 50.0), sample(1, 4, 0.0, 0.0),
                                                sample(0, 5, 0.5, 100.0)};
  // The last spike is of the second bin: a bin ends before its end.
  const std::vector<SpikeEvent> spikes = {{.time = milliseconds{5}, .neuron = 1},
                                          {.time = milliseconds{5}, .neuron = 3},
                                          {.time = milliseconds{6}, .neuron = 4},
                                          {.time = milliseconds{6}, .neuron = 0},
                                          {.time = milliseconds{12}, .neuron = 3}};
  const std::vector<TickRecord> ticks = {{.time = milliseconds{20}}, {.time = milliseconds{40}}};
  ASSERT_TRUE((*sink)->write({.samples = samples, .spikes = spikes, .ticks = ticks}));
  ASSERT_TRUE((*sink)->write({.ticks = ticks}));
  EXPECT_EQ((*sink)->delivered(), 5U);
  for (const char* const stream : {"samples", "samples_1", "spikes"}) {
    EXPECT_EQ(RedisServer::cli("xlen stimulator_" + std::string(stream)), "1\n") << stream;
  }

  const auto entries = [](const std::string& stream) {
    return RedisServer::cli("xrange stimulator_" + stream + " - +");
  };
  const std::string first = entries("samples");
  EXPECT_TRUE(first.ends_with("sync\n{\"merkel_time_ns\":5000000}\ntime_ns\n" +
                              bytes_of(3 * ms, 5 * ms) + "\ndepth_mm\n" + bytes_of(0.25, 0.5) +
                              "\nforce_N\n" + bytes_of(0.05, 0.1) + "\n"))
      << first;
  EXPECT_EQ(first.find("\nsync\n") - first.find("\nts\n"), 12U) << "its time is of 8 bytes";
  const std::string second = entries("samples_1");
  EXPECT_TRUE(second.ends_with("sync\n{\"merkel_time_ns\":4000000}\ntime_ns\n" + bytes_of(4 * ms) +
                               "\nx_mm\n" + bytes_of(3.0) + "\ny_mm\n" + bytes_of(4.0) + "\n"))
      << second;
  const std::string fired = entries("spikes");
  EXPECT_TRUE(fired.ends_with("sync\n{\"merkel_time_ns\":12000000}\ntime_ns\n" +
                              bytes_of(5 * ms, 5 * ms, 6 * ms, 6 * ms, 12 * ms) + "\nneuron\n" +
                              bytes_of(1U, 3U, 4U, 0U, 3U) + "\n"))
      << fired;
  EXPECT_EQ(RedisServer::cli("xlen stimulator_counts"), "3\n");
  const auto counts = [](int time_ms, std::uint16_t one, std::uint16_t two, std::uint16_t three) {
    return "{\"merkel_time_ns\":" + std::to_string(time_ms) + "000000}\ncounts\n" +
           bytes_of(one, two, three) + "\n";
  };
  for (const std::string& bin : {counts(12, 1, 0, 1), counts(22, 0, 0, 1), counts(32, 0, 0, 0)}) {
    EXPECT_TRUE(has(entries("counts"), bin)) << bin;
  }
}

TEST_F(RedisSinkTest, CountsOfALongStopAreNotSent) {
  SinkSetup setup = stim_setup();
  setup.neurons = 1;
  const auto sink = open_sink(RedisServer::uri(), setup);
  ASSERT_TRUE(sink) << sink.error().sentence;
  ASSERT_TRUE((*sink)->begin({}));
  const auto tick = [&](int time_ms) {
    const std::vector<TickRecord> ticks = {{.time = milliseconds{time_ms}}};
    EXPECT_TRUE((*sink)->write({.ticks = ticks}));
    return RedisServer::cli("xlen stimulator_counts");
  };
  EXPECT_EQ(tick(10'000), "1000\n");
  const std::vector<SpikeEvent> spikes = {{.time = milliseconds{10'001}, .neuron = 1}};
  EXPECT_TRUE((*sink)->write({.spikes = spikes}));
  EXPECT_EQ(tick(20'005), "1001\n");
  EXPECT_TRUE(
      has(RedisServer::cli("xrevrange stimulator_counts + - count 1"),
          "{\"merkel_time_ns\":20000000000}\ncounts\n" + bytes_of(std::uint16_t{0}) + "\n"));
  const auto none = open_sink(RedisServer::uri() + "2&bin_ms=0", setup);
  ASSERT_TRUE(none) << none.error().sentence;
  ASSERT_TRUE((*none)->begin({}));
  const std::vector<TickRecord> ticks = {{.time = milliseconds{100}}};
  EXPECT_TRUE((*none)->write({.spikes = spikes, .ticks = ticks}));
  EXPECT_EQ(RedisServer::cli("xlen stimulator2_spikes"), "1\n");
  EXPECT_EQ(RedisServer::cli("xlen stimulator2_counts"), "0\n");
}

TEST_F(RedisSinkTest, KeepsItsStreamsShort) {
  const auto sink = open_sink(RedisServer::uri() + "&maxlen=100", stim_setup());
  ASSERT_TRUE(sink) << sink.error().sentence;
  for (int k = 0; k < 2000; ++k) ASSERT_TRUE((*sink)->write({.sent = commands()}));
  EXPECT_LT(std::stoi(RedisServer::cli("xlen stimulator")), 400);
}

/// A run that notes what the sink reports.
class NotingRun final : public RunControl {
 public:
  void watch(std::span<const std::uint32_t> /*neurons*/) noexcept override {}
  [[nodiscard]] bool tare(std::size_t /*probe*/) override { return false; }
  void mark(const Mark& /*mark*/) override {}
  void notice(const std::string& sentence) override { notices.push_back(sentence); }
  [[nodiscard]] StimulationSwitch& stimulation() noexcept override { return stimulation_; }
  [[nodiscard]] Link link(std::size_t /*probe*/) const override { return Link::kConnected; }

  std::vector<std::string> notices;

 private:
  StimulationSwitch stimulation_;
};

/// Writes until the sink reports that its receiver is there, or away.
bool write_until(Sink& sink, bool away) {
  for (int k = 0; k < 500; ++k) {
    EXPECT_TRUE(sink.write({.sent = commands()}));
    if (sink.interrupted() == away) return true;
    std::this_thread::sleep_for(milliseconds{20});
  }
  return false;
}

TEST_F(RedisSinkTest, AfterARestartOfTheServerAnOffComesFirstAndTheRunGoesOn) {
  NotingRun run;
  const auto sink = open_sink(RedisServer::uri(), stim_setup());
  ASSERT_TRUE(sink) << sink.error().sentence;
  (*sink)->attach(run);
  const std::vector<TickRecord> ticks = {{.time = milliseconds{20}}, {.time = milliseconds{30}}};
  ASSERT_TRUE((*sink)->write({.sent = commands(), .ticks = ticks}));
  EXPECT_FALSE((*sink)->interrupted());
  server_->stop();
  ASSERT_TRUE(write_until(**sink, true));
  ASSERT_EQ(run.notices.size(), 1U);
  EXPECT_TRUE(has(run.notices[0], "stimulation is over there")) << run.notices[0];
  server_ = std::make_unique<RedisServer>();
  ASSERT_TRUE(write_until(**sink, false));
  EXPECT_EQ(run.notices.size(), 2U);
  const std::string first = RedisServer::cli("xrange stimulator - + count 1");
  EXPECT_TRUE(has(first, "time_ns\n30000000\nheartbeat\n1\namplitude_uA\n[0,0]\n")) << first;
  EXPECT_TRUE(has(first, "stop\n[\"sink_failure\",\"sink_failure\"]\n")) << first;
  EXPECT_TRUE(has(RedisServer::cli("xrange stimulator_state - +"), "NODE_STARTED"));
  // Of the commands that came while it was away, none was written.
  EXPECT_EQ(RedisServer::cli("xlen stimulator"), "2\n");
  EXPECT_TRUE((*sink)->close());
}

TEST_F(RedisSinkTest, WithoutElectrodesNothingIsSaidOfStimulation) {
  NotingRun run;
  const auto sink = open_sink(RedisServer::uri(), {.neurons = 3});
  ASSERT_TRUE(sink) << sink.error().sentence;
  (*sink)->attach(run);
  const std::vector<SpikeEvent> spikes = {{.time = milliseconds{20}, .neuron = 1}};
  ASSERT_TRUE((*sink)->write({.spikes = spikes}));
  server_->stop();
  for (int k = 0; k < 500 && !(*sink)->interrupted(); ++k) {
    ASSERT_TRUE((*sink)->write({.spikes = spikes}));
    std::this_thread::sleep_for(milliseconds{20});
  }
  ASSERT_EQ(run.notices.size(), 1U);
  EXPECT_FALSE(has(run.notices[0], "stimulation")) << run.notices[0];
  EXPECT_TRUE(has(run.notices[0], "get nothing until it answers")) << run.notices[0];
}

TEST_F(RedisSinkTest, AServerThatIsOutOfMemoryGetsAnOffOnceItHasMemory) {
  const auto sink = open_sink(RedisServer::uri(), stim_setup());
  ASSERT_TRUE(sink) << sink.error().sentence;
  ASSERT_TRUE((*sink)->write({.sent = commands()}));
  ASSERT_EQ(RedisServer::cli("config set maxmemory 1"), "OK\n");
  ASSERT_TRUE(write_until(**sink, true));
  ASSERT_EQ(RedisServer::cli("config set maxmemory 0"), "OK\n");
  ASSERT_TRUE(write_until(**sink, false));
  const std::string all = RedisServer::cli("xrange stimulator - +");
  EXPECT_TRUE(has(all, "stop\n[\"sink_failure\",\"sink_failure\"]\n")) << all;
}

TEST_F(RedisSinkTest, AServerThatAnswersWithinTheWatchdogIsNotAway) {
  SinkSetup setup = stim_setup();
  setup.run.encoding.stimulation.watchdog = std::chrono::seconds{60};
  const auto sink = open_sink(RedisServer::uri(), setup);
  ASSERT_TRUE(sink) << sink.error().sentence;
  server_->signal(SIGSTOP);
  std::thread later([this] {
    std::this_thread::sleep_for(milliseconds{1500});  // longer than to connect
    server_->signal(SIGCONT);
  });
  EXPECT_TRUE((*sink)->write({.sent = commands()}));
  later.join();
  EXPECT_FALSE((*sink)->interrupted());
  EXPECT_EQ(RedisServer::cli("xlen stimulator"), "1\n");
}

TEST_F(RedisSinkTest, AServerThatStallsIsAwayAfterTheWatchdog) {
  const auto sink = open_sink(RedisServer::uri(), stim_setup());
  ASSERT_TRUE(sink) << sink.error().sentence;
  server_->signal(SIGSTOP);
  EXPECT_TRUE((*sink)->write({.sent = commands()}));
  EXPECT_TRUE((*sink)->interrupted());
  server_->signal(SIGCONT);
}

TEST_F(RedisSinkTest, AnInterruptionThatIsOverIsReportedOnceMoreToTheGate) {
  NotingRun run;
  const auto sink = open_sink(RedisServer::uri(), stim_setup());
  ASSERT_TRUE(sink) << sink.error().sentence;
  (*sink)->attach(run);
  const std::vector<SpikeEvent> spikes = {{.time = milliseconds{5}, .neuron = 1}};
  for (std::size_t times = 1; times <= 2; ++times) {
    server_->stop();
    for (int k = 0; k < 2; ++k) ASSERT_TRUE((*sink)->write({.spikes = spikes}));
    ASSERT_EQ(run.notices.size(), 2 * times - 1);
    EXPECT_FALSE(has(run.notices.back(), "it failed ()")) << run.notices.back();
    EXPECT_EQ((*sink)->delivered(), times - 1);
    server_ = std::make_unique<RedisServer>();
    for (int k = 0; k < 500 && run.notices.size() < 2 * times; ++k) {
      ASSERT_TRUE((*sink)->write({.spikes = spikes}));
      std::this_thread::sleep_for(milliseconds{20});
    }
    ASSERT_EQ(run.notices.size(), 2 * times);
    EXPECT_EQ((*sink)->delivered(), times);  // those that came when it answered again
    EXPECT_TRUE((*sink)->interrupted());
    EXPECT_FALSE((*sink)->interrupted());
    const std::string first = RedisServer::cli("xrange stimulator - + count 1");
    EXPECT_TRUE(has(first, "time_ns\n0\nheartbeat\n0\n")) << first;  // no tick, no update yet
  }
}

/// A server that ends every connection at once, and counts them.
class HangingUp {
 public:
  explicit HangingUp(int port) : listener_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    const int on = 1;
    ::setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    bound_ = ::bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
             ::listen(listener_, 16) == 0;
    thread_ = std::thread([this] {
      for (int one = 0; (one = ::accept(listener_, nullptr, nullptr)) >= 0; ::close(one)) ++count;
    });
  }
  HangingUp(const HangingUp&) = delete;
  HangingUp& operator=(const HangingUp&) = delete;
  ~HangingUp() {
    ::shutdown(listener_, SHUT_RDWR);
    thread_.join();
    ::close(listener_);
  }
  [[nodiscard]] bool bound() const { return bound_; }

  std::atomic<int> count = 0;

 private:
  int listener_;
  bool bound_ = false;
  std::thread thread_;
};

TEST_F(RedisSinkTest, ConnectsAgainWithGrowingPausesOfAtMostASecond) {
  const auto sink = open_sink(RedisServer::uri(), stim_setup());
  ASSERT_TRUE(sink) << sink.error().sentence;
  server_->stop();
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_TRUE((*sink)->write({.sent = commands()}));
  const HangingUp other(RedisServer::port());
  ASSERT_TRUE(other.bound());
  const std::vector<SpikeEvent> spikes = {{.time = milliseconds{5}, .neuron = 1}};
  while (other.count < 6) {
    ASSERT_TRUE((*sink)->write({.spikes = spikes, .sent = commands()}));
    std::this_thread::sleep_for(milliseconds{1});
  }
  const auto took = std::chrono::steady_clock::now() - begin;
  // Pauses of 50, 100, 200, 400, 800 and 1000 ms; if a second were the least pause, 31 s.
  EXPECT_GE(took, milliseconds{2550});
  EXPECT_LT(took, std::chrono::seconds{12});
}

TEST_F(RedisSinkTest, SaysAtItsEndThatTheServerIsStillAway) {
  const auto sink = open_sink(RedisServer::uri(), stim_setup());
  ASSERT_TRUE(sink) << sink.error().sentence;
  server_->stop();
  ASSERT_TRUE(write_until(**sink, true));
  const auto closed = (*sink)->close();
  ASSERT_FALSE(closed);
  EXPECT_TRUE(has(closed.error().sentence, "check the Redis server")) << closed.error().sentence;
}

TEST(RedisSink, RefusesWithHowToWriteIt) {
  const auto refusal = [](const std::string& uri) {
    const auto sink = open_sink(uri, stim_setup());
    return sink ? "" : sink.error().sentence;
  };
  if (has(refusal("redis:"), "built without")) GTEST_SKIP() << refusal("redis:");
  EXPECT_TRUE(has(refusal("redis:"), "redis:127.0.0.1:6379"));
  EXPECT_TRUE(has(refusal("redis:127.0.0.1:1"), "start it with redis-server --port 1"));
  EXPECT_TRUE(has(refusal("redis:192.0.2.1:6379"), "--allow-remote"));
  EXPECT_TRUE(has(refusal("redis:127.0.0.1:6379?node=a%20b"), "the option node must have"));
  EXPECT_TRUE(has(refusal("redis:127.0.0.1:1?maxlen=0"), "maxlen"));
  EXPECT_TRUE(has(refusal("redis:127.0.0.1:1?maxlen=1"), "start it with redis-server --port 1"));
  const std::string node = "redis:127.0.0.1:1?node=";
  EXPECT_TRUE(has(refusal(node + std::string(64, 'a')), "start it with redis-server --port 1"));
  EXPECT_TRUE(has(refusal(node + std::string(65, 'a')), "the option node must have"));
  EXPECT_TRUE(has(refusal("redis:127.0.0.1:1?nodes=a"), "option"));
}

}  // namespace
}  // namespace merkel
