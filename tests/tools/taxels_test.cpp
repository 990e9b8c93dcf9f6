// Tactile arrays, from the channels of a device to spikes, sessions and replays.
#include <algorithm>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <nlohmann/json.hpp>
#include <sys/socket.h>
#include <unistd.h>

#include "drivers/sessions/session_reader.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/text_has.hpp"
#include "tests/tools/program.hpp"
#include "tools/run/session_replay.hpp"
#include "tools/scene/scene_file.hpp"
#include "tools/scene/session_scene.hpp"

namespace merkel {
namespace {

constexpr const char* kExample = "tools/examples/taxel_array.toml";

/// An array at a TCP port that prints its clock and 16 × 16 pressures once a millisecond: noise,
/// and after a second a press of 30 kPa on four taxels. One taxel is dead, another has
/// no value; if it fails, none has one after 2.5 s.
class ArrayServer {
 public:
  explicit ArrayServer(bool fails = false)
      : fails_(fails), listener_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    EXPECT_EQ(::bind(listener_, reinterpret_cast<sockaddr*>(&address), size), 0);
    EXPECT_EQ(::listen(listener_, 1), 0);
    EXPECT_EQ(::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size), 0);
    port_ = ntohs(address.sin_port);
    thread_ = std::jthread([this](const std::stop_token& stop) { serve(stop); });
  }
  ~ArrayServer() {
    thread_.request_stop();
    ::shutdown(listener_, SHUT_RDWR);
    thread_.join();
    ::close(listener_);
  }
  [[nodiscard]] std::string uri() const {
    return "tcp:127.0.0.1:" + std::to_string(port_) + "?protocol=csv&columns=time_us,taxel_kPa*256";
  }

 private:
  /// The values of a reading, whose noise repeats after five.
  [[nodiscard]] static std::string values(int k, bool pressed, bool none) {
    std::string text;
    for (int i = 0; i < 256; ++i) {
      const bool under_press = pressed && (i == 119 || i == 120 || i == 135 || i == 136);
      const int noise = i == 7 ? 0 : (k * 7919 + i * 104729) % 5 - 2;
      const bool gap = i == 9 || none;
      const double kPa = (under_press ? 30.0 : 0.0) + 0.01 * noise;
      text += gap ? ",nan" : "," + std::to_string(kPa).substr(0, 6);
    }
    return text + "\n";
  }

  // A line costs next to nothing while it is sent, so that a busy machine keeps its pace.
  void serve(const std::stop_token& stop) const {
    std::vector<std::string> rest;
    std::vector<std::string> pressed;
    for (int k = 0; k < 5; ++k) {
      rest.push_back(values(k, false, false));
      pressed.push_back(values(k, true, false));
    }
    const std::string none = values(0, false, true);
    const int client = ::accept(listener_, nullptr, nullptr);
    if (client < 0) return;
    const auto start = std::chrono::steady_clock::now();
    for (int k = 0; !stop.stop_requested(); ++k) {
      const std::string& tail = fails_ && k > 2500 ? none : (k > 1000 ? pressed : rest)[k % 5];
      const std::string line = std::to_string(1000 * k) + tail;
      if (::send(client, line.data(), line.size(), MSG_NOSIGNAL) < 0) break;
      std::this_thread::sleep_until(start + (k + 1) * std::chrono::milliseconds{1});
    }
    ::close(client);
  }

  bool fails_;
  int listener_;
  int port_ = 0;
  std::jthread thread_;
};

TEST(Taxels, TheExampleRunsAndReplaysBitForBit) {
  const TemporaryFolder folder;
  const std::string session = folder.path("s.xdf");
  const auto run = run_program(
      {"run", kExample, "--fast", "--duration-s", "1.5", "--json", "--sink", "xdf:" + session});
  ASSERT_EQ(run.exit_code, 0) << run.err << run.out;
  const auto json = nlohmann::json::parse(run.out);
  EXPECT_GT(json["spikes"], 200);
  const auto& press = json["probes"][0]["deepest_press"];
  EXPECT_NEAR(press["force_N"].get<double>(), 1.0, 0.03);
  // A contact of 4 mm radius, in taxels of 1 mm².
  EXPECT_NEAR(press["contact_area_mm2"].get<double>(), 50.0, 6.0);
  EXPECT_NEAR(press["peak_pressure_kPa"].get<double>(), 29.8, 1.0);
  EXPECT_TRUE(has(press["validity"], "256 taxels")) << press;
  const auto replay = run_program({"replay", session});
  EXPECT_EQ(replay.exit_code, 0) << replay.out << replay.err;
  const auto rows = run_program({"inspect", "session", session, "--stream", "taxels"});
  EXPECT_TRUE(rows.out.starts_with("tick,probe,time_s,first,count,p0,p1"))
      << rows.out.substr(0, 200);
  EXPECT_GT(std::count(rows.out.begin(), rows.out.end(), '\n'), 1000);
}

TEST(Taxels, ALostBlockIsNoticed) {
  const TemporaryFolder folder;
  const std::string path = folder.path("s.xdf");
  ASSERT_EQ(run_program({"run", kExample, "--fast", "--duration-s", "0.6", "--sink", "xdf:" + path})
                .exit_code,
            0);
  auto session = SessionReader::open(path);
  ASSERT_TRUE(session);
  const auto scene = scene_of_session(*session);
  ASSERT_TRUE(scene);
  auto model = TactileModel::create(scene->model);
  ASSERT_TRUE(model);
  SessionReplay replay(*model);
  bool dropped = false;
  for (SessionChunk chunk; session->next(chunk).value_or(false);) {
    if (!dropped && chunk.taxels.size() > 40) {
      chunk.taxels.erase(chunk.taxels.begin() + 30);
      dropped = true;
    }
    replay.take(chunk);
  }
  ASSERT_TRUE(dropped);
  EXPECT_TRUE(has(replay.finish().difference, "the taxels of tick")) << replay.finish().difference;
}

TEST(Taxels, AnArrayOfADeviceIsZeroedAndItsFaultsAreNamed) {
  const TemporaryFolder folder;
  const ArrayServer array;
  const std::string scene = folder.file(
      "array.toml",
      "preset = \"goodwin\"\n[[device]]\nname = \"pad\"\nuri = \"" + array.uri() +
          "&live=0\"\n[[probe]]\ndevice = \"pad\"\ntip = \"taxels\"\ntaxel_columns = 16\ntaxel_rows = 16\n");
  const std::string session = folder.path("s.xdf");
  const auto run = run_program(
      {"run", scene, "--fast", "--duration-s", "2", "--json", "--sink", "xdf:" + session});
  ASSERT_EQ(run.exit_code, 0) << run.err << run.out;
  EXPECT_TRUE(has(run.err, "zero and noise of 256 taxels measured over 20 readings")) << run.err;
  EXPECT_TRUE(has(run.err, "taxel8_kPa never changed at rest, unlike the others")) << run.err;
  EXPECT_TRUE(has(run.err, "no value from taxel10_kPa: taken as 0")) << run.err;
  const auto json = nlohmann::json::parse(run.out);
  const auto& press = json["probes"][0]["deepest_press"];
  EXPECT_NEAR(press["force_N"].get<double>(), 0.12, 0.001);
  EXPECT_NEAR(press["contact_area_mm2"].get<double>(), 4.0, 1e-9) << press;
  EXPECT_GT(json["spikes"], 10);
  EXPECT_EQ(json["probes"][0]["device"]["refused"], 0);
  EXPECT_EQ(run_program({"replay", session}).exit_code, 0);
}

constexpr const char* kArrayTip = "tip = \"taxels\"\ntaxel_columns = 16\ntaxel_rows = 16\n";

TEST(Taxels, AnArrayWithoutValuesIsReleasedAndInTheVerdict) {
  const TemporaryFolder folder;
  const ArrayServer array(true);
  const std::string scene = folder.file(
      "s.toml", "preset = \"goodwin\"\n[probe]\nuri = \"" + array.uri() + "\"\n" + kArrayTip);
  const auto run = run_program({"run", scene, "--duration-s", "5"});
  EXPECT_EQ(run.exit_code, 1) << run.out;
  EXPECT_TRUE(has(run.err, "no value from taxel1_kPa, taxel2_kPa")) << run.err;
  EXPECT_TRUE(has(run.out, ": 256 of its 256 taxels had no value (taxel1_kPa, ")) << run.out;
  EXPECT_FALSE(has(run.out + run.err, "damaged, impossible")) << run.err;
}

TEST(Taxels, ThePlanRehearsesAnArray) {
  const auto plan = run_program({"plan", kExample});
  EXPECT_EQ(plan.exit_code, 0) << plan.err;
  EXPECT_TRUE(has(plan.out, "256 taxels")) << plan.out;
}

TEST(Taxels, AnArrayHasNoContactToInspect) {
  const auto run =
      run_program({"inspect", "field", "--scene", kExample, "--depth-mm", "1", "--r-mm", "0"});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_TRUE(has(run.err, "makes no contact that can be computed")) << run.err;
}

TEST(Taxels, ASessionIsAProbeOfAnArray) {
  const TemporaryFolder folder;
  const std::string session = folder.path("s.xdf");
  const std::string a = folder.path("a.csv");
  const std::string b = folder.path("b.csv");
  ASSERT_EQ(run_program({"run", kExample, "--fast", "--duration-s", "0.9", "--sink",
                         "xdf:" + session, "--sink", "csv:" + a})
                .exit_code,
            0);
  const auto again = run_program(
      {"run", kExample, "--probe", "replay:" + session, "--fast", "--sink", "csv:" + b});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_GT(read_file(a).size(), 1000U);
  EXPECT_EQ(read_file(a), read_file(b));
}

std::string error_of(const std::string& probe, const std::string& more = "") {
  const TemporaryFolder folder;
  const std::string scene =
      folder.file("s.toml", "preset = \"goodwin\"\n" + more + "[probe]\n" + probe);
  const auto run = run_program({"run", scene, "--fast", "--duration-s", "0.3"});
  std::string err = run.err;
  if (err.starts_with("merkel: still ")) err.erase(0, err.find('\n') + 1);  // a slow machine
  EXPECT_EQ(std::count(err.begin(), err.end(), '\n'), run.exit_code == 0 ? 0 : 1) << run.err;
  return err;
}

TEST(Taxels, WrongArraysGiveOneSentence) {
  const std::string pad = "uri = \"sim:pad?columns=4&rows=4\"\n";
  const std::string tip = "tip = \"taxels\"\ntaxel_columns = 4\ntaxel_rows = 4\n";
  EXPECT_EQ(error_of(pad + tip), "");
  EXPECT_TRUE(has(error_of(pad), "set tip = \"taxels\" in [probe]"));
  EXPECT_TRUE(
      has(error_of("uri = \"sim:pad\"\n" + tip), "the array has 16 taxels, but 256 channels"));
  EXPECT_TRUE(has(error_of(tip), "the array has 16 taxels, but 0 channels")) << error_of(tip);
  EXPECT_TRUE(has(error_of(pad + tip + "taxel_width_mm = 1.2\n"), "makes taxels overlap"));
  EXPECT_TRUE(has(error_of(pad + tip + "taxel_pitch_mm = nan\n"), "taxel_pitch_mm must be"));
  EXPECT_TRUE(has(error_of(pad + "tip = \"taxels\"\n"), "taxel_columns is missing"));
  EXPECT_TRUE(has(error_of(pad + tip + "invert_force = true\n"), "invert_force"));
  EXPECT_TRUE(has(error_of(pad + tip, "[neuron]\nkind = \"hodgkin_huxley\"\n"),
                  "needs neurons that the energy density drives"));
  EXPECT_TRUE(has(error_of(pad + tip, "[skin]\nstiffening_mm = 2\n"), "must be inf"));
  EXPECT_EQ(
      error_of(pad + "tip = \"taxels\"\ntaxel_centres_mm = [[0,0],[1,0],[2,0],[3,0],[0,1],[1,1],"
                     "[2,1],[3,1],[0,2],[1,2],[2,2],[3,2],[0,3],[1,3],[2,3],[3,3]]\n"),
      "");
}

// Only blocks that change are recorded: a constant press has its blocks in its first tick.
TEST(Taxels, APlaybackFromWithinAPressHasItsPressures) {
  const TemporaryFolder folder;
  std::string rows = "time_s,a_kPa,b_kPa\n";
  for (int k = 0; k < 600; ++k) rows += std::to_string(0.001 * k) + ",30,20\n";
  const std::string scene = folder.file(
      "s.toml", "preset = \"goodwin\"\n[probe]\nuri = \"replay:" + folder.file("t.csv", rows) +
                    "\"\ntip = \"taxels\"\ntaxel_columns = 2\ntaxel_rows = 1\n");
  const std::string whole = folder.path("whole.xdf");
  const std::string part = folder.path("part.xdf");
  ASSERT_EQ(run_program({"run", scene, "--fast", "--sink", "xdf:" + whole}).exit_code, 0);
  const auto played =
      run_program({"replay", whole, "--realtime", "--from-s", "0.4", "--sink", "xdf:" + part});
  ASSERT_EQ(played.exit_code, 0) << played.err;
  const auto taxels = run_program({"inspect", "session", part, "--stream", "taxels"});
  EXPECT_TRUE(has(taxels.out, ",0,2,30,20")) << taxels.out << taxels.err;
}

// From a recording through a simulated device to connect and its scene.
TEST(Taxels, AWideTraceIsRecordedPlayedAndConnected) {
  const TemporaryFolder folder;
  const std::string trace = folder.path("pad.csv");
  const std::string pad = "sim:pad?columns=8&rows=8&contact_mm=2&force_N=0.3";
  const auto refused = run_program({"record", pad, folder.path("pad.xdf")});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_TRUE(has(refused.err, "the ending .csv")) << refused.err;
  ASSERT_EQ(run_program({"record", pad, trace, "--duration-s", "1.5"}).exit_code, 0);
  EXPECT_TRUE(has(read_file(trace), "time_s,force_N,taxel1_kPa,taxel2_kPa"));
  const auto scene = [&](const std::string& uri) {
    return folder.file("s.toml", "preset = \"goodwin\"\n[probe]\nuri = \"" + uri +
                                     "\"\ntip = \"taxels\"\ntaxel_columns = 8\ntaxel_rows = 8\n");
  };
  const auto spikes = [&](const std::string& uri) {
    const std::string file = folder.path("spikes.csv");
    const auto run = run_program({"run", scene(uri), "--fast", "--duration-s", "1.2", "--sink",
                                  "csv:" + file, "--overwrite"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return read_file(file);
  };
  EXPECT_GT(spikes(pad).size(), 1000U);
  EXPECT_EQ(spikes("replay:" + trace), spikes(pad));
  const auto as_trace =
      run_program({"run", scene(pad), "--fast", "--record", folder.path("x.csv")});
  EXPECT_EQ(as_trace.exit_code, 2);
  EXPECT_TRUE(has(as_trace.err, "record a session (xdf:FILE) instead")) << as_trace.err;

  const std::string link = folder.path("tty");
  StartedProgram device({"simulate-probe", "csv", "--trace", trace, "--link", link, "--repeat",
                         "--duration-s", "20"});
  for (int i = 0; i < 500 && !std::filesystem::exists(link); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds{10});
  }
  const std::string connected = folder.path("connected.toml");
  const auto connect = run_program(
      {"connect", "serial:" + link + "?protocol=csv&columns=time_us,seq,force_N,taxel_kPa*64",
       "--out", connected});
  ASSERT_EQ(connect.exit_code, 0) << connect.err << connect.out;
  EXPECT_TRUE(has(connect.out, "array: 64 taxels")) << connect.out;
  const auto run = run_program({"run", connected, "--duration-s", "2", "--json"});
  ASSERT_LE(run.exit_code, 1) << run.err;
  EXPECT_GT(nlohmann::json::parse(run.out)["spikes"], 10);
  device.send(SIGTERM);
  static_cast<void>(device.finish());
}

TEST(Taxels, AMissingValueInATraceIsBridgedForThreeRows) {
  const TemporaryFolder folder;
  const auto force_after = [&](int missing) {
    std::string rows = "time_s";
    for (int i = 1; i <= 40; ++i) rows += ",taxel" + std::to_string(i) + "_kPa";
    rows += "\n";
    for (int k = 0; k < 400; ++k) {
      rows += std::to_string(0.001 * k);
      const bool gap = k >= 400 - missing;
      for (int i = 0; i < 40; ++i) rows += gap ? "," : ",30";
      rows += "\n";
    }
    const std::string session = folder.path("s.xdf");
    const auto run = run_program(
        {"run",
         folder.file("s.toml",
                     "preset = \"goodwin\"\n[probe]\nuri = \"replay:" + folder.file("t.csv", rows) +
                         "\"\ntip = \"taxels\"\ntaxel_columns = 8\ntaxel_rows = 5\n"),
         "--fast", "--sink", "xdf:" + session, "--overwrite"});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    const auto ticks = run_program({"inspect", "session", session, "--stream", "ticks"});
    const auto last = ticks.out.rfind('\n', ticks.out.size() - 2);
    return ticks.out.substr(last + 1);
  };
  EXPECT_TRUE(has(force_after(3), ",1200,")) << force_after(3);
  EXPECT_FALSE(has(force_after(5), ",1200,")) << force_after(5);
}

TEST(Taxels, ATraceWithAColumnPerTaxelFeedsAnArray) {
  const TemporaryFolder folder;
  std::string rows = "time_s,a_N,b_N,c_mN,d_kPa\n";
  for (int k = 0; k < 400; ++k) rows += std::to_string(0.001 * k) + ",0.03,0,30,30\n";
  const std::string scene = folder.file(
      "s.toml", "preset = \"goodwin\"\n[probe]\nuri = \"replay:" + folder.file("t.csv", rows) +
                    "\"\ntip = \"taxels\"\ntaxel_columns = 2\ntaxel_rows = 2\n");
  const auto run = run_program({"run", scene, "--fast", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto json = nlohmann::json::parse(run.out);
  EXPECT_NEAR(json["probes"][0]["deepest_press"]["force_N"].get<double>(), 0.09, 1e-6);
  EXPECT_NEAR(json["probes"][0]["deepest_press"]["contact_area_mm2"].get<double>(), 3.0, 1e-9);
}

TEST(Taxels, ElectrodesFeelTheForceWhereTheBallPresses) {
  const TemporaryFolder folder;
  const auto run = [&](const std::string& encoder) {
    std::string text =
        "preset = \"goodwin\"\n[[probe]]\nuri = \"sim:pad?count=2&wait_s=0.1\"\n"
        "tip = \"taxels\"\ntaxel_columns = 16\ntaxel_rows = 16\n"
        "[stimulation]\nmax_charge_nC = 16\nmax_total_uA = 400\n"
        "watchdog_ms = 100\nfrequency_Hz = [50, 200]\n";
    for (const char* const name_and_field :
         {"under\"\nfield_mm = [15, 10, 1]", "beside\"\nfield_mm = [4, 2, 1]"}) {
      text += "[[electrode]]\nencoder = \"" + encoder + "\"\namplitude_uA = [20, 80]\nname = \"" +
              name_and_field + "\n";
    }
    return run_program({"run", folder.file("s.toml", text), "--fast", "--duration-s", "1",
                        "--overwrite", "--sink", "stim-csv:" + folder.path("stim.csv")});
  };
  for (const char* const encoder : {"linear", "linear_amplitude", "biomimetic"}) {
    const ProgramRun made = run(encoder);
    ASSERT_EQ(made.exit_code, 0) << made.err;
    const std::string commands = read_file(folder.path("stim.csv"));
    const auto on = [&](const std::string& electrode) {
      std::size_t count = 0;
      for (std::size_t at = 0;
           (at = commands.find("," + electrode + ",update,", at)) < commands.size(); ++at) {
        count += commands[at + electrode.size() + 9] == '0' ? 0 : 1;
      }
      return count;
    };
    EXPECT_GT(on("under"), 20U) << encoder;
    EXPECT_EQ(on("beside"), 0U) << encoder;
  }
  EXPECT_TRUE(has(run("okorokova").err,
                  "electrode[under].encoder = \"okorokova\" needs the depth of a press, which a "
                  "tactile array does not measure"));
}

}  // namespace
}  // namespace merkel
