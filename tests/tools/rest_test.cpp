// The drift of a sensor at rest, and where a probe meets the skin.
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <numbers>
#include <regex>
#include <span>
#include <thread>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "core/math/random.hpp"
#include "drivers/protocols/trace_file.hpp"
#include "drivers/simulation/pty_master.hpp"
#include "tests/drivers/simulation/line_printer.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/program.hpp"
#include "tools/connect/rest_drift.hpp"
#include "tools/connect/skin_contact.hpp"

namespace merkel {
namespace {

/// A sensor of 2 mN noise (uniform, rms 2 mN) at 100 Hz whose drift decays with a time constant.
RestDrift warming_up(double seconds, double drift_mN, double constant_s) {
  Random random(3);
  RestDrift drift;
  for (int i = 0; i < static_cast<int>(100 * seconds); ++i) {
    const double time_s = 0.01 * i;
    const double noise = 2e-3 * std::numbers::sqrt3 * (2.0 * random.uniform() - 1.0);
    drift.add(time_s, 1e-3 * drift_mN * (1.0 - std::exp(-time_s / constant_s)) + noise);
  }
  return drift;
}

TEST(RestDrift, IsTheSlopeOfAWarmingSensorUntilItIsWarm) {
  // 60 mN with 100 s: 0.6 mN/s at first, 0.44 mN/s in the middle of the first minute.
  const RestDrift cold = warming_up(61.0, 60.0, 100.0);
  ASSERT_TRUE(cold.slope());
  EXPECT_NEAR(1e3 * *cold.slope(), 0.445, 0.03);
  EXPECT_NEAR(1e3 * cold.noise(), 2.0, 0.1);
  EXPECT_FALSE(cold.is_warm());
  EXPECT_GE(1e3 * cold.largest_slope(), 0.5);
  // After 400 s it drifts by 60 mN · (e⁻³·⁴ − e⁻⁴) = 0.9 mN in a minute.
  const RestDrift warm = warming_up(401.0, 60.0, 100.0);
  EXPECT_TRUE(warm.is_warm());
  EXPECT_NE(drift_text(warm, true).find("has warmed up"), std::string::npos);
  EXPECT_TRUE(drift_line(warm).starts_with("zero_drift_mN_per_s = ")) << drift_line(warm);
  EXPECT_FALSE(warming_up(3.0, 60.0, 100.0).slope());
}

// 0.5 mN/s, in one value every 4 s, or at 8 Hz with a gap of 10 s after each 2 s.
TEST(RestDrift, IsPerSecondForASlowOrInterruptedSensor) {
  RestDrift slow;
  for (int i = 0; i <= 30; ++i) slow.add(4.0 * i, 5e-4 * 4.0 * i);
  RestDrift interrupted;
  for (int i = 0; i <= 960; ++i) {
    if (i % 96 < 16) interrupted.add(0.125 * i, 5e-4 * 0.125 * i);
  }
  for (const RestDrift& drift : {slow, interrupted}) {
    ASSERT_TRUE(drift.slope());
    EXPECT_NEAR(1e3 * *drift.slope(), 0.5, 1e-9);
    EXPECT_NEAR(1e3 * drift.largest_slope(), 0.5, 1e-9);
    EXPECT_EQ(drift.seconds(), 120U);
  }
}

TEST(RestDrift, DoctorMeasuresItForAsLongAsTheUserLetsIt) {
  LinePrinter gauge("0");
  gauge.drift(0.0, 1e-5);  // at about 200 lines a second, at least 0.2 mN/s also on a busy host
  const std::string uri = "serial:" + gauge.name() + "?protocol=csv&columns=force_N";
  const auto run = run_program({"doctor", "--probe", uri, "--seconds", "8", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto json = nlohmann::json::parse(run.out);
  EXPECT_GE(json["seconds"], 5) << run.out;
  EXPECT_GT(json["drift_mN_per_s"], 0.1) << run.out;
  EXPECT_LT(json["drift_mN_per_s"], 2.2) << run.out;
  EXPECT_EQ(json["warmed_up"], false);

  StartedProgram program({"doctor", "--probe", uri, "--seconds", "600"});
  std::this_thread::sleep_for(std::chrono::seconds{5});
  program.send(SIGINT);
  const ProgramRun interrupted = program.finish();
  EXPECT_EQ(interrupted.exit_code, 0) << interrupted.err;
  EXPECT_NE(interrupted.out.find("drift at rest:"), std::string::npos) << interrupted.out;
}

TEST(RestDrift, ConnectWritesItBesideTheThresholdOfContact) {
  const TemporaryFolder folder;
  LinePrinter gauge("0");
  gauge.drift(0.0, 1e-6);
  const auto connected =
      run_program({"connect", "serial:" + gauge.name() + "?protocol=csv&columns=force_N",
                   "--rest-s", "7", "--out", folder.path("s.toml")});
  ASSERT_EQ(connected.exit_code, 0) << connected.err << connected.out;
  EXPECT_NE(connected.out.find("drift at rest: +"), std::string::npos) << connected.out;
  std::smatch found;
  const std::string scene = read_file(folder.path("s.toml"));
  ASSERT_TRUE(std::regex_search(
      scene, found,
      std::regex("zero = \"track\".*\nzero_drift_mN_per_s = ([0-9.e-]+)  # three times the drift")))
      << scene;
  EXPECT_GT(std::stod(found[1]), 0.04);
  EXPECT_LT(std::stod(found[1]), 0.7);
}

/// A descent of a Hertzian tip from 2 mm above the skin, which is at `skin_mm` of the stage.
void descend(double skin_mm, double noise_mN, std::vector<double>& depth_mm,
             std::vector<double>& force_N) {
  Random random(7);
  for (int i = 0; i < 3000; ++i) {
    depth_mm.push_back(skin_mm - 2.0 + 1e-3 * i);
    const double inside = std::max(0.0, depth_mm.back() - skin_mm);
    force_N.push_back(0.3 * inside * std::sqrt(inside) + 0.02 +
                      1e-3 * noise_mN * std::numbers::sqrt3 * (2.0 * random.uniform() - 1.0));
  }
}

TEST(SkinContact, IsWhereTheForceLeavesTheNoiseToAFewHundredthsOfAMillimetre) {
  for (const double noise_mN : {0.0, 0.5, 2.0}) {
    std::vector<double> depth_mm;
    std::vector<double> force_N;
    descend(12.3, noise_mN, depth_mm, force_N);
    const auto skin = skin_depth_mm(depth_mm, force_N);
    ASSERT_TRUE(skin) << noise_mN;
    EXPECT_NEAR(*skin, 12.3, 0.03) << noise_mN;
    EXPECT_FALSE(skin_depth_mm(std::span(depth_mm).first(1900), std::span(force_N).first(1900)));
    EXPECT_FALSE(skin_depth_mm(std::vector<double>(3000, 12.3), force_N)) << "it does not move";
  }
}

/// A stage that is lowered onto the skin at 12.5 mm once the program asks for it.
class Descent {
 public:
  Descent() {
    EXPECT_TRUE(pty_.plug_in());
    thread_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested() && !pty_.heard()) {
        std::this_thread::sleep_for(std::chrono::milliseconds{5});
      }
      double depth_mm = 12.0;
      while (!stop.stop_requested()) {
        if (lowered_ && depth_mm < 13.5) depth_mm += 0.01;
        const double inside = std::max(0.0, depth_mm - 12.5);
        const std::string line = std::to_string(0.3 * inside * std::sqrt(inside)) + "," +
                                 std::to_string(depth_mm) + "\r\n";
        const std::vector<std::uint8_t> bytes(line.begin(), line.end());
        pty_.write(bytes);
        std::uint8_t waste[256];
        static_cast<void>(pty_.read(waste, std::chrono::milliseconds{5}));
      }
    });
  }
  ~Descent() {
    thread_.request_stop();
    thread_.join();
  }
  [[nodiscard]] const std::string& name() const { return pty_.name(); }
  void lower() { lowered_ = true; }

 private:
  PtyMaster pty_;
  std::atomic<bool> lowered_{false};
  std::jthread thread_;
};

TEST(SkinContact, ConnectWritesItAsDepthZero) {
  const TemporaryFolder folder;
  Descent stage;
  const std::string uri = "serial:" + stage.name() + "?protocol=csv&columns=force_N,depth_mm";
  StartedProgram program({"connect", uri, "--skin-s", "60", "--out", folder.path("lever.toml")});
  // Its rate is measured first, for a second; the probe then hangs above the skin for a while.
  std::this_thread::sleep_for(std::chrono::seconds{5});
  stage.lower();
  const ProgramRun connected = program.finish();
  ASSERT_EQ(connected.exit_code, 0) << connected.err << connected.out;
  EXPECT_NE(connected.out.find("skin: the force leaves the noise at a depth of 12."),
            std::string::npos)
      << connected.out;
  const std::string gauge = read_file(folder.path("lever.gauge.toml"));
  const auto at = gauge.find("[depth]\nsource = \"depth\"\ngain = 1.0\nzero = ");
  ASSERT_NE(at, std::string::npos) << gauge;
  EXPECT_NEAR(std::stod(gauge.substr(gauge.find("zero = ") + 7)), 12.5, 0.03) << gauge;
  EXPECT_NE(
      read_file(folder.path("lever.toml")).find("calibration=" + folder.path("lever.gauge.toml")),
      std::string::npos);
  const auto run = run_program({"run", folder.path("lever.toml"), "--duration-s", "0.3", "--json"});
  EXPECT_NE(run.exit_code, 2) << run.err;
  const auto recorded =
      run_program({"record", uri + "&calibration=" + folder.path("lever.gauge.toml"),
                   folder.path("t.csv"), "--duration-s", "0.1"});
  ASSERT_EQ(recorded.exit_code, 0) << recorded.err;
  auto trace = TraceReader::open(folder.path("t.csv"));
  ASSERT_TRUE(trace);
  std::vector<ProbeSample> samples(1);
  ASSERT_EQ(*trace->read(samples), 1U);
  EXPECT_NEAR(samples[0].depth_mm, 1.0, 0.05);
}

}  // namespace
}  // namespace merkel
