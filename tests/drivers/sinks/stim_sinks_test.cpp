// The sinks of stimulation commands. The Redis sink is tested against a real server.
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "drivers/sinks/open_sink.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/text_has.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using Kind = StimulationCommand::Kind;
using Stop = StimulationCommand::Stop;

SinkSetup stim_setup() {
  SinkSetup setup{.neurons = 20, .run = {}};
  for (const char* const name : {"E1", "E2"}) {
    Electrode electrode{.name = name};
    electrode.amplitude_uA = {20.0, 80.0};
    electrode.frequency_Hz = {0.0, 200.0};
    setup.run.encoding.electrodes.push_back(electrode);
  }
  setup.run.encoding.stimulation.watchdog = milliseconds{200};
  return setup;
}

std::vector<SentCommand> commands() {
  const std::vector<StimulationCommand> all = {
      {.time = std::chrono::nanoseconds{3'200'001},
       .amplitude_uA = 80.0,
       .electrode = 1,
       .kind = Kind::kPulse},
      {.time = milliseconds{10}, .amplitude_uA = 1.0 / 3.0, .frequency_Hz = 55.5, .heartbeat = 1},
      {.time = milliseconds{10}, .heartbeat = 1, .electrode = 1, .stop = Stop::kGap}};
  std::vector<SentCommand> sent;
  for (const StimulationCommand& each : all) {
    sent.push_back({.command = each, .sent = milliseconds{500}, .valid_until = milliseconds{560}});
  }
  return sent;
}

TEST(StimCsvSink, WritesOneRowACommand) {
  const TemporaryFolder folder;
  const std::string path = folder.path("commands.csv");
  {
    const auto sink = open_sink("stim-csv:" + path, stim_setup());
    ASSERT_TRUE(sink) << sink.error().sentence;
    EXPECT_FALSE((*sink)->takes<SpikeEvent>());
    ASSERT_TRUE((*sink)->write({.sent = commands()}));
    ASSERT_TRUE((*sink)->close());
  }
  std::ifstream file(path);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(file), {}),
            "time_s,electrode,kind,amplitude_uA,frequency_Hz,heartbeat,stop,sent_monotonic_ns,"
            "valid_until_ns\n"
            "0.003200001,E2,pulse,80,0,0,,500000000,560000000\n"
            "0.010000000,E1,update,0.3333333333333333,55.5,1,,500000000,560000000\n"
            "0.010000000,E2,update,0,0,1,gap,500000000,560000000\n");
}

TEST(StimSinks, ThoseWithThreadsOfATransportNameThem) {
  SinkSetup setup = stim_setup();
  const auto one = open_sink("stim-zmq:tcp://127.0.0.1:25574", setup);
  const auto other = open_sink("stim-zmq:tcp://127.0.0.1:25575", setup);
  ASSERT_TRUE(one && other);
  const auto threads = (*one)->transport_threads();
  ASSERT_FALSE(threads.empty());
  for (const pid_t thread : threads) {
    EXPECT_TRUE(std::filesystem::exists("/proc/self/task/" + std::to_string(thread)));
    for (const pid_t of_other : (*other)->transport_threads()) EXPECT_NE(thread, of_other);
  }
}

TEST(StimSinks, NeedElectrodes) {
  SinkSetup none = stim_setup();
  none.run.encoding.electrodes.clear();
  for (const char* const uri : {"stim-csv:commands.csv", "stim-zmq:tcp://127.0.0.1:25571"}) {
    const auto sink = open_sink(uri, none);
    ASSERT_FALSE(sink);
    EXPECT_NE(sink.error().sentence.find("the scene has no electrodes"), std::string::npos) << uri;
  }
}

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
  void stop() {
    if (process_ <= 0) return;
    ::kill(process_, SIGKILL);
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
  ASSERT_TRUE((*sink)->write({.sent = commands()}));
  EXPECT_FALSE((*sink)->interrupted());
  server_->stop();
  ASSERT_TRUE(write_until(**sink, true));
  ASSERT_EQ(run.notices.size(), 1U);
  EXPECT_TRUE(has(run.notices[0], "stimulation is over there")) << run.notices[0];
  server_ = std::make_unique<RedisServer>();
  ASSERT_TRUE(write_until(**sink, false));
  EXPECT_EQ(run.notices.size(), 2U);
  const std::string first = RedisServer::cli("xrange stimulator - + count 1");
  EXPECT_TRUE(has(first, "amplitude_uA\n[0,0]\n")) << first;
  EXPECT_TRUE(has(first, "stop\n[\"sink_failure\",\"sink_failure\"]\n")) << first;
  EXPECT_TRUE(has(RedisServer::cli("xrange stimulator_state - +"), "NODE_STARTED"));
  // Of the commands that came while it was away, none was written.
  EXPECT_EQ(RedisServer::cli("xlen stimulator"), "2\n");
  EXPECT_TRUE((*sink)->close());
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
  EXPECT_TRUE(has(refusal("redis:127.0.0.1:1?nodes=a"), "option"));
}

}  // namespace
}  // namespace merkel
