// Attacks on the program from outside: hostile files, text, peers and signals. tests/README.md
// lists them all.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <thread>

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <nlohmann/json.hpp>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include "tests/drivers/simulation/line_printer.hpp"
#include "tests/drivers/simulation/running_device.hpp"
#include "tests/free_ports.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/text_has.hpp"
#include "tests/tools/lower_limit.hpp"
#include "tests/tools/program.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;

#ifdef MERKEL_SANITIZED
constexpr int kSlowdown = 10;
#else
constexpr int kSlowdown = 1;
#endif

/// Whether a terminal would obey something in a text: a control character but line ends and tabs.
bool controls(const std::string& text) {
  return std::any_of(text.begin(), text.end(), [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return (byte < 0x20 && c != '\n' && c != '\t') || byte == 0x7F;
  });
}

TEST(Attack, EndlessAndForeignFilesAreRefusedInLittleMemory) {
  const TemporaryFolder folder;
  std::string bytes(100'000, '\0');
  for (std::size_t i = 0; i < bytes.size(); ++i)
    bytes[i] = static_cast<char>(i * i * 2654435761U >> 13U);
  const std::string random = folder.file("random", bytes);
  const std::string out = folder.path("out.csv");
  for (const std::string& file : {std::string("/dev/zero"), random, folder.path("")}) {
    const std::vector<std::vector<std::string>> commands = {
        {"run", file, "--fast"},
        {"run", "--fast", "--probe", "replay:" + file},
        {"record", "replay:" + file, out},
        {"replay", file},
        {"export", file, "--sink", "csv:" + out},
        {"inspect", "session", file},
        {"plan", file},
        {"simulate-probe", "hbf1", "--trace", file},
        {"fit", "skin", "--trace", file},
        {"record", "serial:/dev/null?protocol=hbf1&calibration=" + file, out}};
    for (const auto& command : commands) {
      const ProgramRun run = run_program(command);
      EXPECT_TRUE(run.exit_code == 2 || run.exit_code == 3)
          << command[0] << " " << file << ": " << run.exit_code << run.err;
      EXPECT_FALSE(run.err.empty()) << command[0];
      EXPECT_FALSE(controls(run.err)) << command[0] << " " << file << run.err;
#ifndef MERKEL_SANITIZED
      EXPECT_LT(run.peak_memory_MiB, 100.0) << command[0] << " " << file;
#endif
      EXPECT_FALSE(std::filesystem::exists(out)) << command[0];
    }
  }
}

TEST(Attack, DeviceTextNeverReachesTheTerminalRaw) {
  const TemporaryFolder folder;
  // Turns the window's title, clears the screen, rings, goes to the left. All at once, because the
  // program waits for most of the time.
  std::vector<std::thread> gauges;
  for (const std::string& line :
       {std::string("\x1b]0;pwned\a0.300 \x1b[2J"), std::string("0.300 N\x9b"),
        std::string("Force\x1b[31m: 0.3 stone\x7f")}) {
    gauges.emplace_back([&folder, line, number = std::to_string(gauges.size())] {
      const LinePrinter gauge(line);
      const std::string port = "serial:" + gauge.name();
      std::vector<std::vector<std::string>> commands = {{"connect", gauge.name(), "--yes", "--out",
                                                         folder.path(number + ".toml"),
                                                         "--overwrite"}};
      for (const char* const protocol : {"csv", "mark10", "grbl", "zaber&um_per_step=1"}) {
        commands.push_back({"record", port + "?protocol=" + protocol + "&timeout_ms=300",
                            folder.path(number + ".csv"), "--duration-s", "0.1", "--overwrite"});
      }
      for (const auto& command : commands) {
        const ProgramRun run = run_program(command);
        EXPECT_FALSE(controls(run.err + run.out)) << command[0] << ": " << run.err << run.out;
      }
    });
  }
  for (std::thread& gauge : gauges) gauge.join();
}

TEST(Attack, ANameThatIsNoUtf8CostsNoSummary) {
  const TemporaryFolder folder;
  const std::string name = folder.path("caf\xe9.csv");  // as Latin-1 writes it
  const auto run = run_program({"run", "--fast", "--sink", "csv:" + name, "--json"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_GT(nlohmann::json::parse(run.out)["spikes"], 10);
  EXPECT_TRUE(std::filesystem::exists(name));
}

TEST(Attack, AStoppedProgramGoesOnAndItsSessionReplays) {
  const TemporaryFolder folder;
  RunningDevice device("hbf1", {});
  StartedProgram program({"run", "--probe", device.uri(), "--duration-s", "3", "--json", "--sink",
                          "xdf:" + folder.path("s.xdf")});
  std::this_thread::sleep_for(milliseconds{2200});
  program.send(SIGSTOP);
  std::this_thread::sleep_for(milliseconds{500});
  program.send(SIGCONT);
  const ProgramRun run = program.finish();
  EXPECT_EQ(run.exit_code, 1) << run.err;
  EXPECT_TRUE(has(run.out, "were skipped")) << run.out;
  EXPECT_GE(nlohmann::json::parse(run.out)["gaps"], 1);
  const auto replay = run_program({"replay", folder.path("s.xdf")});
  EXPECT_EQ(replay.exit_code, 0) << replay.err << replay.out;
  EXPECT_TRUE(has(replay.out, "bit-identical")) << replay.out;
}

TEST(Attack, AFolderThatGoesDuringARunEndsItsSinkWithASentence) {
  auto folder = std::make_unique<TemporaryFolder>();
  const TemporaryFolder other;
  const std::string gone = folder->path("s.csv");
  StartedProgram program({"run", "--probe", "sim:ramp?wait_s=0&live=1&hold_s=9", "--duration-s",
                          "1.5", "--json", "--sink", "csv:" + gone, "--sink",
                          "csv:" + other.path("s.csv")});
  // The second file is created after the first.
  const std::string second = other.path("s.csv.part");
  for (int k = 0; k < 3000 && !std::filesystem::exists(second); ++k) {
    std::this_thread::sleep_for(milliseconds{10});
  }
  folder.reset();
  const ProgramRun run = program.finish();
  EXPECT_EQ(run.exit_code, 1) << run.err;
  EXPECT_TRUE(has(run.err, gone)) << run.err;
  const auto summary = nlohmann::json::parse(run.out);
  EXPECT_EQ(summary["sinks"][1]["delivered"], summary["spikes"]);
  EXPECT_TRUE(std::filesystem::exists(other.path("s.csv")));
}

TEST(Attack, FewDescriptorsOrLittleMemoryIsASentence) {
  const std::vector<std::string> arguments = {
      "run",           "--fast", "--sink",
      "csv:/dev/null", "--sink", "view:" + std::to_string(free_ports(1).front())};
  const auto run_with = [&](__rlimit_resource_t resource, rlim_t most) {
    std::optional<StartedProgram> program;
    {
      const LowerLimit limit(resource, most);
      program.emplace(arguments);
    }
    return program->finish();
  };
  for (rlim_t descriptors = 4; descriptors < 24; descriptors += 3) {
    const ProgramRun run = run_with(RLIMIT_NOFILE, descriptors);
    EXPECT_EQ(run.ended_by, 0) << descriptors << run.err;
    EXPECT_TRUE(run.exit_code == 0 || !run.err.empty()) << descriptors;
  }
#ifndef MERKEL_SANITIZED  // a sanitizer's shadow needs terabytes of addresses
  for (rlim_t mebibytes = 16; mebibytes <= 256; mebibytes *= 2) {
    const ProgramRun run = run_with(RLIMIT_AS, mebibytes << 20U);
    EXPECT_EQ(run.ended_by, 0) << mebibytes << run.err;
  }
  // Enough for some of the threads of a run, but not for all. A shell sets the limit, because these
  // tests may have more addresses themselves.
  const TemporaryFolder folder;
  for (int mebibytes = 60; mebibytes <= 130; mebibytes += 5) {
    const int status = std::system(
        ("ulimit -v " + std::to_string(1024 * mebibytes) + " && exec " + MERKEL_PROGRAM +
         " run --probe 'sim:taps?live=1' --duration-s 0.2 --overwrite --sink xdf:" +
         folder.path("s.xdf") + " >/dev/null 2>" + folder.path("err"))
            .c_str());
    const std::string err = read_file(folder.path("err"));
    EXPECT_TRUE(WIFEXITED(status)) << mebibytes << err;
    EXPECT_TRUE(WEXITSTATUS(status) == 0 || has(err, "ulimit -v")) << mebibytes << err;
  }
#endif
}

/// A TCP server on loopback that does to each connection what it is told.
class Server {
 public:
  template <class Action>
  explicit Server(Action action) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t length = sizeof address;
    EXPECT_EQ(::bind(socket_, reinterpret_cast<sockaddr*>(&address), length), 0);
    EXPECT_EQ(::listen(socket_, 8), 0);
    ::getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &length);
    port_ = ntohs(address.sin_port);
    thread_ = std::jthread([this, action](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        const int client = ::accept4(socket_, nullptr, nullptr, SOCK_CLOEXEC);
        if (client < 0) return;
        action(client, stop);
        ::close(client);
      }
    });
  }
  ~Server() {
    thread_.request_stop();
    ::shutdown(socket_, SHUT_RDWR);
    thread_.join();
    ::close(socket_);
  }
  [[nodiscard]] std::string uri() const { return "tcp:127.0.0.1:" + std::to_string(port_); }

 private:
  int socket_;
  std::uint16_t port_ = 0;
  std::jthread thread_;
};

void send_text(int client, const std::string& text) {
  static_cast<void>(::send(client, text.data(), text.size(), MSG_NOSIGNAL));
}

TEST(Attack, ALineWithoutEndTakesNoMemory) {
  const Server server([](int client, const std::stop_token& stop) {
    for (int k = 0; k < 100; ++k) {
      send_text(client, "0.300\n");
      std::this_thread::sleep_for(milliseconds{2});
    }
    const std::string endless(1 << 16U, '7');
    for (int k = 0; k < 2000 && !stop.stop_requested(); ++k) send_text(client, endless);
    for (int k = 0; k < 400 && !stop.stop_requested(); ++k) {
      send_text(client, "\n0.300");
      std::this_thread::sleep_for(milliseconds{5});
    }
  });
  const auto run = run_program({"run", "--probe", server.uri() + "?protocol=csv&columns=force_N",
                                "--duration-s", "1", "--json"});
  EXPECT_EQ(run.ended_by, 0);
  EXPECT_FALSE(run.out.empty()) << run.err;
#ifndef MERKEL_SANITIZED
  EXPECT_LT(run.peak_memory_MiB, 150.0);
#endif
}

TEST(Attack, AServerThatHangsUpAtOnceIsCountedAndItsNoticesAreFew) {
  const Server server([](int client, const std::stop_token& /*stop*/) {
    for (int k = 0; k < 20; ++k) {
      send_text(client, "0.300\n");
      std::this_thread::sleep_for(milliseconds{2});
    }
  });
  const auto run = run_program({"run", "--probe", server.uri() + "?protocol=csv&columns=force_N",
                                "--duration-s", "2", "--json"});
  EXPECT_EQ(run.ended_by, 0);
  ASSERT_FALSE(run.out.empty()) << run.err;
  const auto summary = nlohmann::json::parse(run.out);
  EXPECT_GE(summary["probes"][0]["device"]["outages"], 3);
  EXPECT_GT(summary["probes"][0]["used"], 50);
  EXPECT_LT(std::count(run.err.begin(), run.err.end(), '\n'), 40) << run.err;
}

TEST(Attack, FourThousandPatchesRunAndTwoHundredArePlannedWithinSeconds) {
  const TemporaryFolder folder;
  const auto patches = [&](int count) {
    std::string text = "preset = \"paper\"\n";
    for (int i = 0; i < count; ++i) text += "[[receptors]]\n";
    return folder.file(std::to_string(count) + ".toml", text);
  };
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(run_program({"run", patches(4096), "--fast", "--duration-s", "0.01"}).exit_code, 0);
  EXPECT_EQ(run_program({"plan", patches(200)}).exit_code, 0);
  // 3 s on an idle machine; minutes where each patch computes its own tables.
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds{kSlowdown * 30});
}

TEST(Attack, AGapOfDaysIsReportedAtOnceAndWithItsCost) {
  const TemporaryFolder folder;
  const std::string trace = folder.file("gap.csv", "time_s,depth_mm\n0,0\n1000000,1\n");
  StartedProgram program({"run", "--fast", "--probe", "replay:" + trace});
  std::this_thread::sleep_for(milliseconds{6500});
  program.send(SIGINT);
  const ProgramRun run = program.finish();
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_TRUE(has(run.err, "all of this time is simulated")) << run.err;
  EXPECT_TRUE(has(run.err, "of at least 1000000 s in ")) << run.err;
  EXPECT_TRUE(has(run.err, "s more; an interrupt")) << run.err;
}

TEST(Attack, ManyProbesAreReportedOrRefusedWithTheirCost) {
  const TemporaryFolder folder;
  const auto probes = [&](int count, const std::string& uri) {
    std::string text = "preset = \"paper\"\n";
    for (int i = 0; i < count; ++i) text += "[[probe]]\nuri = \"" + uri + "\"\n";
    return folder.file(std::to_string(count) + ".toml", text);
  };
  const ProgramRun many =
      run_program({"run", probes(300, "sim:ramp"), "--fast", "--duration-s", "0.01"});
  EXPECT_EQ(many.exit_code, 0) << many.err;
  EXPECT_TRUE(has(many.err, "300 probes on 300 devices take 300 threads and 0.1 GB")) << many.err;
  // Each has a ring of four seconds: 0.3 MB at 1 kHz, 29 MB at 100 kHz.
  const ProgramRun too_many = run_program(
      {"run", probes(9000, "sim:ramp?rate_hz=100000"), "--fast", "--duration-s", "0.01"});
  EXPECT_EQ(too_many.exit_code, 3) << too_many.err;
  EXPECT_TRUE(has(too_many.err, "use fewer probes or a lower rate")) << too_many.err;
}

}  // namespace
}  // namespace merkel
