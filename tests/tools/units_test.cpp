// Columns in volts, millivolts and counts: their factors in a URI or a calibration file.
#include <cmath>
#include <numbers>
#include <regex>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "core/parameters/parameter_error.hpp"
#include "drivers/protocols/trace_file.hpp"
#include "tests/drivers/simulation/line_printer.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/text_has.hpp"
#include "tests/tools/program.hpp"
#include "tests/tools/terminal.hpp"

namespace merkel {
namespace {

constexpr double kNewtonsPerVolt = 0.17553;  // of a published rig, as is 2.5 mm/V

/// A trace of a second with a press of 0.2 N at a depth of 1.25 mm, in units of its own.
std::string press_in(const std::string& header, double force_unit_N, double depth_unit_mm) {
  std::string text = header + "\n";
  for (int i = 0; i < 500; ++i) {
    const double press = std::sin(std::numbers::pi * i / 500.0);
    text += shortest_decimal(i * 0.002) + "," + shortest_decimal(0.2 * press / force_unit_N) + "," +
            shortest_decimal(1.25 * press / depth_unit_mm) + "\n";
  }
  return text;
}

std::string spikes_of(const TemporaryFolder& folder, const std::string& probe) {
  const std::string file = folder.path("spikes.csv");
  const auto run = run_program(
      {"run", "goodwin", "--fast", "--probe", probe, "--sink", "csv:" + file, "--overwrite"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  return read_file(file);
}

TEST(Units, ATraceInVoltsPressesAsTheSameTraceInNewtons) {
  const TemporaryFolder folder;
  const std::string newtons = folder.file("n.csv", press_in("time_s,force_N,depth_mm", 1.0, 1.0));
  const std::string expected = spikes_of(folder, "replay:" + newtons);
  EXPECT_GT(std::count(expected.begin(), expected.end(), '\n'), 20);
  for (const auto& [header, force_unit_N, depth_unit_mm, keys] :
       {std::tuple("time_s,force_V,depth_V", kNewtonsPerVolt, 2.5,
                   "force_N_per_V=0.17553&depth_mm_per_V=2.5"),
        std::tuple("time_s,force_mV,position_mV", kNewtonsPerVolt / 1e3, 2.5e-3,
                   "force_mN_per_V=175.53&position_mm_per_V=2.5"),
        std::tuple("time_s,force_count,depth_mm", 1.0 / 4096.0, 1.0,
                   "force_N_per_count=0.000244140625")}) {
    const std::string trace = folder.file("v.csv", press_in(header, force_unit_N, depth_unit_mm));
    EXPECT_EQ(spikes_of(folder, "replay:" + trace + "?" + keys), expected) << header;
  }
}

// The advice is followed until the trace is played.
TEST(Units, AColumnInVoltsWithoutItsFactorNamesTheKey) {
  const TemporaryFolder folder;
  std::string probe =
      "replay:" + folder.file("v.csv", press_in("time_s,force_mV,position_V", 0.001, 2.5)) + "?";
  for (const std::string key : {"force_N_per_V", "depth_mm_per_V"}) {
    const auto refused = run_program({"run", "--fast", "--probe", probe});
    EXPECT_EQ(refused.exit_code, 2);
    std::smatch advice;
    ASSERT_TRUE(std::regex_search(refused.err, advice, std::regex(R"(\((\w+_per_\w+)=1.5\))")))
        << refused.err;
    EXPECT_EQ(advice[1], key) << refused.err;
    probe += advice[1].str() + "=1.5&";
  }
  EXPECT_EQ(run_program({"run", "--fast", "--probe", probe}).exit_code, 0);
}

TEST(Units, ATraceTakesFactorsAndZeroFromACalibration) {
  const TemporaryFolder folder;
  const std::string newtons = folder.file("n.csv", press_in("time_s,force_N,depth_mm", 1.0, 1.0));
  const std::string trace = folder.file("v.csv", press_in("time_s,force_V,depth_V", 0.5, 2.5));
  const std::string file = folder.file(
      "rig.toml",
      "force_N_per_V = 0.5\nposition_mm_per_V = 2.5\n[force]\nsource = \"force\"\nzero = 0.0625\n");
  const auto run = run_program(
      {"run", "--fast", "--json", "--probe", "replay:" + trace + "?calibration=" + file});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto json = nlohmann::json::parse(run.out);
  EXPECT_NEAR(json["probes"][0]["deepest_press"]["force_N"].get<double>(), 0.1375, 0.0005);
  EXPECT_EQ(json["validity"][0]["source"], "recorded, calibrated by " + file);
  // What is in N already is not calibrated a second time.
  const auto twice =
      run_program({"run", "--fast", "--probe", "replay:" + newtons + "?calibration=" + file});
  EXPECT_EQ(twice.exit_code, 2);
  EXPECT_NE(twice.err.find("no column is in V"), std::string::npos) << twice.err;
}

/// The forces, in N, that a device which prints `line` sends.
std::vector<double> forces_of(const TemporaryFolder& folder, const LinePrinter& device,
                              const std::string& options, std::string& error) {
  const auto recorded =
      run_program({"record", "serial:" + device.name() + "?protocol=csv&" + options,
                   folder.path("t.csv"), "--duration-s", "0.1", "--overwrite"});
  error = recorded.err;
  std::vector<double> forces;
  if (recorded.exit_code != 0) return forces;
  auto trace = TraceReader::open(folder.path("t.csv"));
  if (!trace) return forces;
  std::vector<ProbeSample> samples(5);
  const auto count = trace->read(samples);
  for (std::size_t i = 0; count && i < *count; ++i) forces.push_back(samples[i].force_mN * 1e-3);
  return forces;
}

TEST(Units, ADeviceInMillivoltsIsReadByItsKeyAndRefusedWithoutIt) {
  const TemporaryFolder folder;
  for (const auto& [line, header, options] :
       {std::tuple("0.0,1500", "", "columns=-,force_mV"),
        std::tuple("0.0,1500", "seq,Load (mV)", "timeout_ms=1500"),
        std::tuple("F: 1.5 V", "", "timeout_ms=1500")}) {
    const LinePrinter gauge(line, 115200,
                            {.silence = std::chrono::milliseconds{300}, .header = header});
    std::string error;
    EXPECT_TRUE(forces_of(folder, gauge, options, error).empty());
    EXPECT_NE(error.find("add the key force_N_per_V"), std::string::npos) << error;
  }
  for (const auto& [line, header, options] :
       {std::tuple("0.0,1500", "", "columns=-,force_mV"),
        std::tuple("0.0,1500", "seq,Load (mV)", "timeout_ms=1500"),
        std::tuple("F: 1.5 V", "", "timeout_ms=1500")}) {
    const LinePrinter gauge(line, 115200,
                            {.silence = std::chrono::milliseconds{300}, .header = header});
    std::string error;
    const auto forces =
        forces_of(folder, gauge, std::string(options) + "&force_N_per_V=0.17553", error);
    ASSERT_FALSE(forces.empty()) << error;
    for (const double force : forces) EXPECT_NEAR(force, 1.5 * kNewtonsPerVolt, 1e-12);
  }
}

TEST(Units, TheCountsOfAnArrayArePressuresByTheirKey) {
  const TemporaryFolder folder;
  std::string rows = "time_s";
  for (int t = 1; t <= 64; ++t) rows += ",t" + std::to_string(t) + "_count";
  for (int i = 0; i < 300; ++i) {
    rows += "\n" + shortest_decimal(i * 0.005);
    for (int t = 1; t <= 64; ++t) rows += i > 100 && t == 28 ? ",4096" : ",0";
  }
  const std::string trace = folder.file("pad.csv", rows + "\n");
  const std::string scene = folder.file(
      "s.toml", "preset = \"goodwin\"\n[probe]\nuri = \"replay:" + trace +
                    "?pressure_kPa_per_count=0.0048828125\"\ntip = \"taxels\"\ntaxel_columns = "
                    "8\ntaxel_rows = 8\ntaxel_pitch_mm = 1\n");
  const auto run = run_program({"run", scene, "--fast", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto press = nlohmann::json::parse(run.out)["probes"][0]["deepest_press"];
  EXPECT_NEAR(press["peak_pressure_kPa"].get<double>(), 20.0, 0.01) << press;
}

/// The number after a key in a text.
double number_after(const std::string& text, const std::string& key) {
  const auto at = text.find(key + " = ");
  return at == std::string::npos ? std::nan("") : std::stod(text.substr(at + key.size() + 3));
}

// A lever whose amplifier sends volts: 0.1 V at rest and 0.17553 N/V, calibrated by weights.
TEST(Calibrate, FindsTheFactorOfAColumnInVoltsByWeightsInGrams) {
  const TemporaryFolder folder;
  LinePrinter gauge("0.1");
  const std::string uri = "serial:" + gauge.name() + "?protocol=csv&columns=force_V";
  const std::string file = folder.path("rig.toml");
  const auto tare = run_program({"calibrate", uri, file, "--seconds", "0.1"});
  EXPECT_EQ(tare.exit_code, 2);
  EXPECT_NE(tare.err.find("force_N_per_V needs two known values"), std::string::npos) << tare.err;

  TerminalProgram program(
      {"calibrate", uri, file, "--points", "0,20g,50g", "--seconds", "0.5", "--saturation", "10"},
      100);
  ASSERT_TRUE(program.wait_for("apply 0 N and press Enter"));
  program.type("\n");
  ASSERT_TRUE(program.wait_for("apply 0.196133 N"));
  gauge.print("1.217376");
  program.type("\n");
  ASSERT_TRUE(program.wait_for("apply 0.490333 N"));
  gauge.print("2.893440");
  program.type("\n");
  const ProgramRun ended = program.finish();
  ASSERT_EQ(ended.exit_code, 0) << ended.err << ended.out;
  const std::string text = read_file(file);
  EXPECT_NEAR(number_after(text, "force_N_per_V"), kNewtonsPerVolt, 1e-6) << text;
  EXPECT_NEAR(number_after(text, "\nzero"), 0.1 * kNewtonsPerVolt, 1e-6) << text;
  EXPECT_NEAR(number_after(text, "\nsaturation"), 10.0 * kNewtonsPerVolt, 1e-5) << text;
  EXPECT_NE(text.find("range = [0.0, 0.490332"), std::string::npos) << text;
  // Three points of 0.5 s are redrawn at most ten times a second, and cleared.
  const std::string redraw = "\r\033[K";
  std::size_t redraws = 0;
  for (auto at = ended.err.find(redraw); at != std::string::npos;
       at = ended.err.find(redraw, at + 1)) {
    ++redraws;
  }
  EXPECT_GE(redraws, 3U);
  EXPECT_LE(redraws, 3U * 7U);

  gauge.print("1.217376");
  std::string error;
  const auto forces = forces_of(folder, gauge, "columns=force_V&calibration=" + file, error);
  ASSERT_FALSE(forces.empty()) << error;
  for (const double force : forces) EXPECT_NEAR(force, 0.196133, 1e-5);
}

TEST(Calibrate, AddsAChannelToTheFileAndReplacesItsOwnOnRequest) {
  const TemporaryFolder folder;
  const LinePrinter gauge("0.5,1.5");
  const std::string uri = "serial:" + gauge.name() + "?protocol=csv&columns=force_N,depth_mm";
  const std::string file = folder.path("gauge.toml");
  const auto calibrate = [&](const std::string& of, const std::string& channel,
                             const std::string& point, bool overwrite) {
    std::vector<std::string> arguments = {"calibrate", of,    file,        "--channel", channel,
                                          "--points",  point, "--seconds", "0.2"};
    if (overwrite) arguments.emplace_back("--overwrite");
    return run_program(arguments);
  };
  ASSERT_EQ(calibrate(uri, "depth", "1mm", false).exit_code, 0);

  // The force drives, and has no calibration: the run says so, and its advice works.
  const auto run = run_program(
      {"run", "--probe", uri + "&calibration=" + file, "--duration-s", "0.1", "--json"});
  std::smatch advice;
  ASSERT_TRUE(std::regex_search(
      run.err, advice,
      std::regex("does not calibrate the force.*calibrate '([^']+)' [^ ]+ --channel force")))
      << run.err;
  const auto added = calibrate(advice[1], "force", "0.25", false);
  ASSERT_EQ(added.exit_code, 0) << added.err;
  std::string text = read_file(file);
  EXPECT_NE(text.find("[depth]\nsource = \"depth\"\ngain = 1.0\nzero = 0.5\n"), std::string::npos)
      << text;
  EXPECT_NE(text.find("[force]\nsource = \"force\"\ngain = 1.0\nzero = 0.25\n"), std::string::npos)
      << text;
  const auto both = run_program(
      {"run", "--probe", uri + "&calibration=" + file, "--duration-s", "0.1", "--json"});
  EXPECT_EQ(both.err.find("does not calibrate"), std::string::npos) << both.err;

  const auto twice = calibrate(uri, "force", "0.5", false);
  EXPECT_EQ(twice.exit_code, 2);
  EXPECT_NE(twice.err.find("already calibrates force: add --overwrite"), std::string::npos)
      << twice.err;
  EXPECT_EQ(read_file(file), text);
  EXPECT_EQ(calibrate(uri, "force", "0.5", true).exit_code, 0);
  text = read_file(file);
  EXPECT_NE(text.find("[force]\nsource = \"force\"\ngain = 1.0\nzero = 0.0\n"), std::string::npos)
      << text;
  EXPECT_NE(text.find("[depth]"), std::string::npos) << text;

  const std::string other = folder.file("scene.toml", "preset = \"goodwin\"\n");
  const auto kept = run_program({"calibrate", uri, other, "--seconds", "0.1", "--overwrite"});
  EXPECT_EQ(kept.exit_code, 2);
  EXPECT_NE(kept.err.find("is not replaced: name another file"), std::string::npos) << kept.err;
  EXPECT_EQ(read_file(other), "preset = \"goodwin\"\n");
}

TEST(Calibrate, ATareOfACalibratedChannelReplacesItsZeroAlone) {
  const TemporaryFolder folder;
  const LinePrinter gauge("0.5");
  const std::string uri = "serial:" + gauge.name() + "?protocol=csv&columns=";
  const std::string in_N = folder.file("n.toml",
                                       "[force]\nsource = \"force\"\ngain = 2.5\nzero = 0.1\n"
                                       "saturation = 1.75\nrange = [0.0, 4.0]\nresidual = 0.02\n");
  const std::string in_V = folder.file("v.toml",
                                       "force_N_per_V = 0.25\n[force]\nsource = \"force\"\n"
                                       "gain = 1.0\nzero = 0.01\nrange = [0.0, 1.0]\n");
  for (const auto& [file, columns, zero] :
       {std::tuple(in_N, "force_N", 0.5), std::tuple(in_V, "force_V", 0.125)}) {
    const std::string before = read_file(file);
    const auto tare = run_program({"calibrate", uri + columns + "&calibration=" + file, file,
                                   "--seconds", "0.2", "--overwrite"});
    ASSERT_EQ(tare.exit_code, 0) << tare.err;
    const std::string after = read_file(file);
    EXPECT_NEAR(number_after(after, "\nzero"), zero, 1e-9) << after;
    for (const std::string key : {"gain", "saturation", "residual", "force_N_per_V"}) {
      const double kept = number_after(before, key);
      if (!std::isfinite(kept)) continue;
      EXPECT_EQ(number_after(after, key), kept) << key << after;
    }
    EXPECT_TRUE(has(after, "range = [0.0, ")) << after;
  }
}

TEST(Calibrate, RefusesPointsInTheUnitOfAnotherQuantity) {
  const TemporaryFolder folder;
  for (const std::string points : {"0,20mm", "0,20 stone", "zero", "1;2"}) {
    const auto run = run_program(
        {"calibrate", "serial:/dev/none?protocol=csv", folder.path("c.toml"), "--points", points});
    EXPECT_EQ(run.exit_code, 2);
    EXPECT_NE(run.err.find("write numbers in N or with a unit"), std::string::npos) << run.err;
  }
}

// 200 g over 100 mm² are 19.6133 kPa, on 25 taxels at 4000 counts.
TEST(Calibrate, FindsTheFactorOfAnArrayByAWeightOverAnArea) {
  const TemporaryFolder folder;
  const auto line = [](bool loaded) {
    std::string text;
    for (int t = 0; t < 64; ++t) {
      const bool under = loaded && t % 8 < 5 && t / 8 < 5;
      text += (t == 0 ? "" : ",") + std::to_string(under ? 4100 : 100);
    }
    return text;
  };
  LinePrinter pad(line(false));
  const std::string uri = "serial:" + pad.name() + "?protocol=csv&columns=taxel_count*64";
  const std::string file = folder.path("pad.toml");
  TerminalProgram program({"calibrate", uri + "#taxels=64", file, "--channel", "taxels", "--points",
                           "0,200g", "--area-mm2", "100", "--seconds", "0.5"},
                          100);
  ASSERT_TRUE(program.wait_for("apply 0 N and press Enter"));
  program.type("\n");
  ASSERT_TRUE(program.wait_for("apply 1.96133 N"));
  pad.print(line(true));
  program.type("\n");
  const ProgramRun ended = program.finish();
  ASSERT_EQ(ended.exit_code, 0) << ended.err << ended.out;
  EXPECT_NE(ended.out.find("19.6133 kPa on 25 loaded taxels"), std::string::npos) << ended.out;
  EXPECT_NEAR(number_after(read_file(file), "pressure_kPa_per_count"), 19.6133 / 4000.0, 1e-8);
  // The file is used by the array whose columns it makes pressures.
  const auto recorded = run_program({"record", uri + "&calibration=" + file + "#taxels=64",
                                     folder.path("p.csv"), "--duration-s", "0.1"});
  EXPECT_EQ(recorded.exit_code, 0) << recorded.err;
}

TEST(Calibrate, PressesBeyondItsPointsAreCountedAndInTheVerdict) {
  const TemporaryFolder folder;
  const std::string file =
      folder.file("c.toml", "[force]\nsource = \"force\"\nrange = [0.0, 0.5]\n");
  for (const auto& [line, outside] :
       {std::pair("0.505", false), std::pair("-0.2", false), std::pair("0.6", true)}) {
    const LinePrinter gauge(line);
    const auto run =
        run_program({"run", "--probe",
                     "serial:" + gauge.name() + "?protocol=csv&columns=force_N&calibration=" + file,
                     "--duration-s", "0.3", "--json"});
    const auto json = nlohmann::json::parse(run.out);
    EXPECT_EQ(json["probes"][0]["device"]["outside_calibration"].get<int>() > 0, outside) << line;
    EXPECT_EQ(
        json["verdict"].dump().find("outside the range of the calibration") != std::string::npos,
        outside)
        << json["verdict"];
  }
}

}  // namespace
}  // namespace merkel
