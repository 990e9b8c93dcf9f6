// Tests merkel connect, and follows the program's advice.
#include <atomic>
#include <regex>
#include <thread>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "drivers/protocols/csv_columns.hpp"
#include "tests/drivers/simulation/line_printer.hpp"
#include "tests/drivers/simulation/running_device.hpp"
#include "tests/free_ports.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/text_has.hpp"
#include "tests/tools/program.hpp"
#include "tests/tools/terminal.hpp"
#include "tools/connect/array_scene.hpp"
#include "tools/connect/hand_scene.hpp"
#include "tools/connect/recognition.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;

/// Live, so long that also a busy host uses some tens of readings.
constexpr const char* kRun_s = "2";

/// Connects with --yes. If the lines state no unit, follows the advice: the URI with the first one.
ProgramRun connect_as_advised(const std::string& target, const std::string& out) {
  const auto asked = run_program({"connect", target, "--yes", "--out", out});
  std::smatch uri;
  if (asked.exit_code != 2 ||
      !std::regex_search(asked.err, uri, std::regex("use the URI '([^']+)'"))) {
    return asked;
  }
  EXPECT_NE(asked.err.find("the numbers have no unit"), std::string::npos) << asked.err;
  return run_program({"connect", uri[1], "--yes", "--out", out});
}

class ConnectTo : public testing::TestWithParam<std::string_view> {};

TEST_P(ConnectTo, WritesASceneThatRuns) {
  const TemporaryFolder folder;
  RunningDevice device(GetParam(), {});
  const std::string port = device.uri().substr(7, device.uri().find('?') - 7);
  const auto connected =
      run_program({"connect", port, "--yes", "--out", folder.path("scene.toml")});
  ASSERT_EQ(connected.exit_code, 0) << connected.err << connected.out;
  EXPECT_NE(connected.out.find("protocol=" + std::string(GetParam())), std::string::npos)
      << connected.out << read_file(folder.path("scene.toml"));
  const auto run =
      run_program({"run", folder.path("scene.toml"), "--duration-s", kRun_s, "--json"});
  EXPECT_NE(run.exit_code, 2) << run.err;
  EXPECT_GT(nlohmann::json::parse(run.out)["probes"][0]["used"], 3);
}

INSTANTIATE_TEST_SUITE_P(Devices, ConnectTo, testing::Values("hbf1", "mark10", "grbl", "zaber"),
                         [](const auto& entry) { return std::string(entry.param); });

TEST(Connect, ACardThatIsNotThereIsNamed) {
  const TemporaryFolder folder;
  const auto connected =
      run_program({"connect", "comedi:/dev/comedi_none", "--out", folder.path("s.toml")});
  const bool built = connected.err.find("libcomedi-dev") == std::string::npos;
  EXPECT_EQ(connected.exit_code, built ? 3 : 2) << connected.err;
  EXPECT_TRUE(!built ||
              connected.err.find("there is no device /dev/comedi_none") != std::string::npos)
      << connected.err;
}

TEST(Connect, RecognisesADeviceWhoseFirstByteArrivesAlone) {
  const TemporaryFolder folder;
  LinePrinter device("Force: 0.300 N", 115200, {.header = {}, .lone_byte = true});
  const auto connected =
      run_program({"connect", device.name(), "--yes", "--out", folder.path("s.toml")});
  EXPECT_EQ(connected.exit_code, 0) << connected.err << connected.out;
}

TEST(Connect, ReadsLinesInTheWildAtAnyBaudRate) {
  for (const auto& [line, columns, baud] :
       {std::tuple("Force: 0.300 N", "columns=force_N", 115200),
        std::tuple("12;0,300;1", "decimal=comma", 9600),
        std::tuple("F=0.119N D=0.143mm", "columns=force_N,depth_mm", 115200),
        std::tuple("60.0 g, 1.50 mm", "columns=force_g,depth_mm", 115200),
        std::tuple("F,123.4,D,0.56", "columns=-,force_g,-,depth_mm", 115200),
        std::tuple("F=60.0 D=1.50", "columns=force_g,depth_mm", 115200),
        std::tuple("0.310 N, 17", "columns=force_N,-", 250000),
        std::tuple("0.300", "columns=force_N", 57600)}) {
    const TemporaryFolder folder;
    const LinePrinter gauge(line, baud);
    const auto connected = connect_as_advised(gauge.name(), folder.path("s.toml"));
    ASSERT_EQ(connected.exit_code, 0) << connected.err << connected.out;
    const std::string scene = read_file(folder.path("s.toml"));
    EXPECT_NE(scene.find(columns), std::string::npos) << scene;
    EXPECT_NE(scene.find("baud=" + std::to_string(baud)), std::string::npos) << scene;
    const auto run = run_program({"run", folder.path("s.toml"), "--duration-s", kRun_s, "--json"});
    EXPECT_NE(run.exit_code, 2) << run.err;
    EXPECT_GT(nlohmann::json::parse(run.out)["probes"][0]["used"], 10);
  }
}

// Its address is the sensor's, at which this program cannot listen.
TEST(Connect, AsksASensorOnTheNetwork) {
  const TemporaryFolder folder;
  const std::string address = "udp:127.0.0.1:" + std::to_string(free_ports(1)[0]);
  RunningDevice sensor(DeviceSimulator::Settings{
      .protocol = &ati_rdt_entry(), .trace = dyadic_press(4000), .network = address});
  const auto connected = run_program({"connect", address, "--yes", "--out", folder.path("s.toml")});
  ASSERT_EQ(connected.exit_code, 0) << connected.err;
  EXPECT_NE(read_file(folder.path("s.toml")).find("protocol=ati_rdt"), std::string::npos);
}

TEST(Connect, RefusesWhatItCannotRecogniseOrWouldReplace) {
  const TemporaryFolder folder;
  const auto simulated = run_program({"connect", "sim:ramp"});
  EXPECT_EQ(simulated.exit_code, 2);
  EXPECT_NE(simulated.err.find("can be recognised"), std::string::npos) << simulated.err;
  const std::string scene = folder.file("s.toml", "");
  const auto taken = run_program({"connect", "udp:127.0.0.1:9", "--out", scene});
  EXPECT_EQ(taken.exit_code, 2);
  EXPECT_NE(taken.err.find("already exists: add --overwrite"), std::string::npos) << taken.err;
}

// The Arduino Uno is silent for 0.8 to 2 s after its port is opened.
TEST(Connect, WaitsForABoardThatResetsAndBelievesItsHeader) {
  const TemporaryFolder folder;
  const LinePrinter board("60.0,1.50", 115200,
                          {.silence = milliseconds{1500}, .header = "force_g,depth_mm"});
  const auto connected = run_program({"connect", board.name(), "--out", folder.path("scene.toml")});
  ASSERT_EQ(connected.exit_code, 0) << connected.err << connected.out;
  const std::string scene = read_file(folder.path("scene.toml"));
  EXPECT_NE(scene.find("columns=force_g,depth_mm"), std::string::npos) << scene;
  EXPECT_NE(scene.find("preset = \"goodwin\""), std::string::npos) << scene;
  EXPECT_NE(connected.out.find("the preset goodwin: the device measures force"), std::string::npos)
      << connected.out;
}

// A board whose USB port tells it that it is opened prints its header at once.
TEST(Connect, BelievesAHeaderThatComesAtOnce) {
  const TemporaryFolder folder;
  const LinePrinter board("60.0,1.50", 115200, {.header = "force_g,depth_mm"});
  const auto connected = run_program({"connect", board.name(), "--out", folder.path("scene.toml")});
  ASSERT_EQ(connected.exit_code, 0) << connected.err << connected.out;
  EXPECT_NE(read_file(folder.path("scene.toml")).find("columns=force_g,depth_mm"),
            std::string::npos);
}

TEST(Connect, RecognisesATactileArray) {
  const TemporaryFolder folder;
  std::string line = "0.02";
  for (int i = 2; i <= 64; ++i) line += i == 20 ? ",3.5" : ",0.02";
  const LinePrinter array(line, 115200, {});
  const std::string scene = folder.path("s.toml");
  EXPECT_EQ(run_program({"connect", array.name(), "--out", scene}).exit_code, 2);
  // Without a unit, no unit is taken: they may as well be counts.
  const auto asked = run_program({"connect", array.name(), "--yes", "--out", scene});
  EXPECT_EQ(asked.exit_code, 2);
  std::smatch uri;
  ASSERT_TRUE(std::regex_search(
      asked.err, uri, std::regex("'([^']+taxel_count\\*64[^']+&pressure_kPa_per_count=1)'")))
      << asked.err;
  const auto connected = run_program({"connect", uri[1], "--overwrite", "--out", scene});
  ASSERT_EQ(connected.exit_code, 0) << connected.err << connected.out;
  EXPECT_NE(connected.out.find("taken as 8 x 8"), std::string::npos) << connected.out;
  const std::string text = read_file(scene);
  EXPECT_NE(text.find("tip = \"taxels\"\ntaxel_columns = 8 "), std::string::npos) << text;
  const auto run = run_program({"run", scene, "--duration-s", kRun_s, "--json"});
  EXPECT_NE(run.exit_code, 2) << run.err << text;
  EXPECT_GT(nlohmann::json::parse(run.out)["probes"][0]["used"], 10);
}

TEST(Connect, ArrangesTaxelsByTheLinesOfAFrameWhereTheyFit) {
  for (const auto& [lines, columns, rows] :
       std::vector<std::tuple<std::string, std::size_t, std::size_t>>{{"", 6, 8},
                                                                      {"&frame_lines=4", 12, 4},
                                                                      {"&frame_lines=5", 6, 8},
                                                                      {"&frame_lines=0", 6, 8}}) {
    const ArrayLayout layout = ArrayLayout::of(48, "serial:/dev/ttyACM0?protocol=csv" + lines);
    EXPECT_EQ(layout.columns, columns) << lines;
    EXPECT_EQ(layout.rows, rows) << lines;
  }
}

TEST(Connect, BelievesAHeaderThatNamesTheTaxelsOfAnArray) {
  const TemporaryFolder folder;
  std::string line = "0.02";
  std::string header = "t1 (kPa)";
  for (int i = 2; i <= 64; ++i) {
    line += i == 20 ? ",3.5" : ",0.02";
    header += ",t" + std::to_string(i) + " (kPa)";
  }
  const LinePrinter array(line, 115200, {.header = header});
  const std::string scene = folder.path("s.toml");
  const auto connected = run_program({"connect", array.name(), "--out", scene});
  ASSERT_EQ(connected.exit_code, 0) << connected.err << connected.out;
  EXPECT_NE(connected.out.find("read as: a tactile array of 64 taxels in kPa\n"), std::string::npos)
      << connected.out;
  const std::string text = read_file(scene);
  EXPECT_NE(text.find("columns=t_kPa*64&"), std::string::npos) << text;
  const auto run = run_program({"run", scene, "--duration-s", kRun_s, "--json"});
  EXPECT_NE(run.exit_code, 2) << run.err << text;
  EXPECT_GT(nlohmann::json::parse(run.out)["probes"][0]["used"], 10);
}

TEST(Connect, TellsATactileArrayFromOtherPressuresAndForces) {
  const auto taxels = [](const std::string& columns) { return taxels_among(channels_in(columns)); };
  EXPECT_EQ(taxels("time_us,p_psi*4"), 4U);
  EXPECT_EQ(taxels("left_kPa,right_kPa,tip_kPa"), 3U);
  EXPECT_EQ(taxels("force_N,air_kPa,supply_kPa"), 0U);
  EXPECT_EQ(taxels("force_N,taxel_kPa*64"), 64U);
  EXPECT_EQ(taxels("thumb_N,index_N,air_kPa"), 0U);
  EXPECT_EQ(taxels("cell_g*16"), 16U);
  EXPECT_EQ(taxels("cell_g*15"), 0U);
}

TEST(Connect, TakesTheNamesOfItsChannelsFromTheFirmware) {
  const TemporaryFolder folder;
  RunningDevice hand(DeviceSimulator::Settings{.protocol = *find_protocol("hbf1"),
                                               .trace = dyadic_press(20'000),
                                               .extra_columns = {"thumb_N", "index_N", "palm_mm"},
                                               .baud = 500'000});
  const std::string port = hand.uri().substr(7, hand.uri().find('?') - 7);
  const auto connected = run_program({"connect", port, "--out", folder.path("s.toml")});
  ASSERT_EQ(connected.exit_code, 0) << connected.err << connected.out;
  EXPECT_NE(connected.out.find("thumb 0 N, index 0 N"), std::string::npos) << connected.out;
  const std::string text = read_file(folder.path("s.toml"));
  EXPECT_NE(text.find("force = \"index_N\"\npatch = \"index\""), std::string::npos) << text;
  EXPECT_EQ(text.find("palm_mm"), std::string::npos) << text;
}

TEST(Connect, TakesAnArrayOfTheFirmware) {
  const TemporaryFolder folder;
  std::vector<ProbeSample> trace(1800);
  std::vector<double> pressures;
  for (std::size_t i = 0; i < trace.size(); ++i) {
    trace[i].time = milliseconds{5 * i};
    for (int t = 0; t < 100; ++t) pressures.push_back(i > 1000 && t == 55 ? 20.0 : 0.0);
  }
  const DeviceSimulator::Settings settings{.protocol = *find_protocol("hbf1"),
                                           .trace = trace,
                                           .taxels = csv_names_of("taxel_kPa*100"),
                                           .others = pressures,
                                           .baud = 500'000,
                                           .link = folder.path("pad")};
  {
    const RunningDevice pad(settings);
    const auto connected =
        run_program({"connect", folder.path("pad"), "--out", folder.path("s.toml")});
    ASSERT_EQ(connected.exit_code, 0) << connected.err << connected.out;
    EXPECT_NE(connected.out.find("taken as 10 x 10"), std::string::npos) << connected.out;
  }
  const RunningDevice pad(settings);  // its trace begins again, without a press
  const auto run = run_program({"run", folder.path("s.toml"), "--duration-s", "6", "--json"});
  EXPECT_NE(run.exit_code, 2) << run.err;
  const auto probe = nlohmann::json::parse(run.out)["probes"][0];
  ASSERT_FALSE(probe["deepest_press"].is_null()) << run.out;
  EXPECT_NEAR(probe["deepest_press"]["peak_pressure_kPa"].get<double>(), 20.0, 0.01) << run.out;
}

TEST(Connect, WaitsForAPortThatIsNotThereYet) {
  const TemporaryFolder folder;
  const std::string link = folder.path("ttyACM0");
  const auto never = run_program({"connect", link, "--wait-s", "0.2"});
  EXPECT_EQ(never.exit_code, 3);
  EXPECT_NE(never.err.find("did not appear within 0.2 s"), std::string::npos) << never.err;
  StartedProgram program({"connect", link, "--wait-s", "30", "--out", folder.path("s.toml")});
  std::this_thread::sleep_for(milliseconds{300});
  const LinePrinter gauge("0.300 N, 1.50 mm", 115200, {}, link);
  const auto connected = program.finish();
  EXPECT_EQ(connected.exit_code, 0) << connected.err << connected.out;
}

TEST(Connect, LinesThatNoStyleReadsAreToldWhatToChange) {
  const TemporaryFolder folder;
  const std::string out = folder.path("s.toml");
  LinePrinter gauge("F0.25N");
  const auto glued = run_program({"connect", gauge.name(), "--out", out});
  EXPECT_EQ(glued.exit_code, 3);
  std::smatch advice;
  ASSERT_TRUE(std::regex_search(glued.err, advice, std::regex("sends \"F0.25N\".*as in ([^ ]+)\n")))
      << glued.err;
  const auto run = run_program({"run", "--probe", "serial:" + gauge.name() + "?protocol=csv"});
  EXPECT_NE(run.err.find(advice[1]), std::string::npos) << run.err;
  EXPECT_EQ(run.err.find("merkel connect"), std::string::npos) << run.err;
  gauge.print(advice[1]);
  const auto followed = run_program({"connect", gauge.name(), "--out", out});
  EXPECT_EQ(followed.exit_code, 0) << followed.err;
  EXPECT_NE(followed.out.find("read as: force_N = 0.25, depth_mm = 1.5"), std::string::npos)
      << followed.out;
}

TEST(Connect, DatagramsWithoutTheEndOfALineAreToldToHaveOne) {
  const TemporaryFolder folder;
  const int port = free_ports(1)[0];
  const std::jthread sender([&](const std::stop_token& stop) {
    const int descriptor = ::socket(AF_INET, SOCK_DGRAM, 0);
    sockaddr_in to{.sin_family = AF_INET,
                   .sin_port = htons(static_cast<std::uint16_t>(port)),
                   .sin_addr = {htonl(INADDR_LOOPBACK)},
                   .sin_zero = {}};
    while (!stop.stop_requested()) {
      static_cast<void>(
          ::sendto(descriptor, "7,0.25", 6, 0, reinterpret_cast<sockaddr*>(&to), sizeof to));
      std::this_thread::sleep_for(milliseconds{10});
    }
    ::close(descriptor);
  });
  const std::string address = "udp:127.0.0.1:" + std::to_string(port);
  const auto connected = run_program({"connect", address, "--out", folder.path("s.toml")});
  EXPECT_EQ(connected.exit_code, 3);
  EXPECT_NE(connected.err.find("without the end of a line: let it send a newline after each"),
            std::string::npos)
      << connected.err;
}

TEST(Connect, AHeaderWithTheTimeInTwoUnitsIsRead) {
  const TemporaryFolder folder;
  const LinePrinter gauge("0.5,500,0.25", 115200, {.header = "time_s,time_ms,force_N"});
  const auto connected = run_program({"connect", gauge.name(), "--out", folder.path("s.toml")});
  EXPECT_NE(connected.out.find("read as: time_s = 0.5, force_N = 0.25"), std::string::npos)
      << connected.err << connected.out;
}

TEST(Connect, TakesColumnsThatAreTypedAtItsQuestion) {
  const TemporaryFolder folder;
  const LinePrinter gauge("60.0,1.50");
  const std::string out = folder.path("s.toml");
  TerminalProgram program({"connect", gauge.name(), "--out", out}, 100);
  ASSERT_TRUE(program.wait_for("listening"));
  program.type("force_g,depth_furlong\n");
  program.type("force_g\n");
  program.type("force_mN,depth_um\n");
  const ProgramRun run = program.finish();
  EXPECT_EQ(run.exit_code, 0) << run.err << run.out;
  EXPECT_NE(run.out.find("the unit of depth_furlong is unknown"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("the lines have 2 columns, but you named 1"), std::string::npos);
  EXPECT_NE(run.out.find("forces are in N, mN, kN, lbF, ozF, kgF, gF"), std::string::npos);
  EXPECT_NE(read_file(out).find("columns=force_mN,depth_um"), std::string::npos);
}

TEST(Connect, ItsCalibrationAdviceForADepthGaugeWorks) {
  const TemporaryFolder folder;
  const LinePrinter gauge("D: 1.50 mm");
  const auto connected = run_program({"connect", gauge.name(), "--out", folder.path("s.toml")});
  ASSERT_EQ(connected.exit_code, 0) << connected.err << connected.out;
  std::smatch advice;
  ASSERT_TRUE(std::regex_search(connected.out, advice,
                                std::regex("merkel calibrate '([^']+)' gauge.toml (.*)\n")))
      << connected.out;
  EXPECT_EQ(advice[2], "--points 0,0.5,1 --channel depth");
  const auto calibrated = run_program({"calibrate", advice[1], folder.path("gauge.toml"),
                                       "--points", "0", "--channel", "depth", "--seconds", "0.2"});
  EXPECT_EQ(calibrated.exit_code, 0) << calibrated.err;
}

TEST(Connect, SetsTheThresholdOfContactAboveTheNoiseAtRest) {
  const TemporaryFolder folder;
  LinePrinter gauge("0");
  gauge.drift(0.0, 1e-5);
  const auto connected = connect_as_advised(gauge.name(), folder.path("s.toml"));
  ASSERT_EQ(connected.exit_code, 0) << connected.err << connected.out;
  const std::string scene = read_file(folder.path("s.toml"));
  std::smatch found;
  ASSERT_TRUE(std::regex_search(scene, found, std::regex("contact_N = ([0-9.e-]+)  # six times")))
      << scene;
  EXPECT_GT(std::stod(found[1]), 1e-4);
  EXPECT_LT(std::stod(found[1]), 0.06);
  EXPECT_NE(scene.find("\nzero = \"track\""), std::string::npos) << scene;
}

// The last reading may be of a press; the noise is that of the time without one.
TEST(Connect, MeasuresTheNoiseBetweenPresses) {
  std::vector<double> values;
  for (int i = 0; i < 1000; ++i) {
    const double noise = 0.002 * ((i * 7) % 11 - 5) / 5.0;
    values.push_back((i > 450 ? 1.5 : 0.0) + noise);
  }
  const auto noise = noise_at_rest(values);
  ASSERT_TRUE(noise);
  EXPECT_NEAR(*noise, 0.00126, 5e-5);
  EXPECT_TRUE(contact_line({.name = "force_N", .last = 1.5, .noise = noise})
                  .starts_with("contact_N = 0.0076"));
  EXPECT_TRUE(contact_line({.name = "depth_mm", .last = 1.5, .noise = noise})
                  .starts_with("contact_mm = 0.0076  # six times the noise of 0.0013 mm"));
  EXPECT_EQ(contact_line({.name = "pad_kPa", .last = 1.5, .noise = noise}), "");
  EXPECT_FALSE(noise_at_rest(std::vector<double>(1000, 1.5)));
  EXPECT_FALSE(noise_at_rest({0.0, 0.001}));
}

TEST(Connect, SaysThatItWasPressedAllTheTime) {
  const TemporaryFolder folder;
  const LinePrinter gauge("0.588 N");
  const auto connected = run_program({"connect", gauge.name(), "--out", folder.path("s.toml")});
  ASSERT_EQ(connected.exit_code, 0) << connected.err << connected.out;
  EXPECT_NE(connected.out.find("force_N was never within 0.1 N of 0"), std::string::npos)
      << connected.out;
}

TEST(Connect, ShowsBothReadingsWhereItCannotDecide) {
  const TemporaryFolder folder;
  const LinePrinter gauge("0.300");
  const auto requested = run_program({"connect", gauge.name(), "--out", folder.path("s.toml")});
  EXPECT_EQ(requested.exit_code, 2);
  EXPECT_NE(requested.out.find("1: force_N = 0.3"), std::string::npos) << requested.out;
  EXPECT_NE(requested.out.find("2: depth_mm = 0.3"), std::string::npos) << requested.out;
  EXPECT_NE(requested.out.find("3: force_g = 0.3"), std::string::npos) << requested.out;
  EXPECT_FALSE(std::filesystem::exists(folder.path("s.toml")));
  // Follows the advice: the URI of the second interpretation.
  std::smatch uri;
  ASSERT_TRUE(std::regex_search(requested.err, uri, std::regex("serial:[^ ]+[?][^ ]+")))
      << requested.err;
  const auto again = run_program({"connect", uri.str(), "--out", folder.path("s.toml")});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_NE(again.out.find("depth 0.3 mm"), std::string::npos) << again.out;
}

/// Runs with a URI; if it is refused with advice "protocol=X" or "columns=Y", follows the advice.
std::string follow_advice(std::string uri, int most) {
  for (int steps = 0; steps < most; ++steps) {
    const auto run =
        run_program({"run", "--probe", uri + "&timeout_ms=700", "--duration-s", "0.1"});
    if (run.exit_code != 2) return uri;
    std::smatch found;
    if (std::regex_search(run.err, found, std::regex("use (protocol=[a-z0-9_]+)"))) {
      uri = std::regex_replace(uri, std::regex("protocol=[a-z0-9_]+"), found[1].str());
    } else if (std::regex_search(run.err, found, std::regex("example (columns=[-a-zA-Z_,]+)"))) {
      std::string columns = found[1].str();
      if (columns.back() == ',') columns.pop_back();
      uri += "&" + columns;
    } else {
      return "no advice: " + run.err;
    }
  }
  return "not fixed: " + uri;
}

TEST(Advice, WorksWhenItIsFollowed) {
  for (const char* line :
       {"Force: 0.300 N", "0.300", "17,0.300,4", "0,300", "12;0,300", "3594641,28,0.2,0.5"}) {
    const LinePrinter gauge(line);
    const std::string uri = follow_advice("serial:" + gauge.name() + "?protocol=mark10", 4);
    EXPECT_TRUE(uri.starts_with("serial:")) << line << ": " << uri;
  }
}

TEST(Connect, GivesEachSensorOfAHandItsProbe) {
  for (const auto& [line, header, expected] :
       {std::tuple("0.31, 0.02, 0.5", "F_thumb (N),F_pinky (N),palm_N",
                   "force = \"F_pinky_N\"\npatch = \"little\""),
        std::tuple("thumb: 310 g, index: 20 g", "", "force = \"index_N\"\npatch = \"index\""),
        std::tuple("0.31,0.02,0.5,0.25,0.125,0.75", "",
                   "force = \"force6_N\"\npatch = \"palm\"  # by its place in the line")}) {
    const TemporaryFolder folder;
    const LinePrinter hand(line, 115200, {.silence = milliseconds{1000}, .header = header});
    const std::string scene = folder.path("s.toml");
    const auto connected = connect_as_advised(hand.name(), scene);
    ASSERT_EQ(connected.exit_code, 0) << connected.err << connected.out;
    const std::string text = read_file(scene);
    EXPECT_NE(text.find(expected), std::string::npos) << text;
    EXPECT_NE(connected.out.find("in each reading"), std::string::npos) << connected.out;
    const auto run = run_program({"run", scene, "--duration-s", kRun_s, "--json"});
    EXPECT_NE(run.exit_code, 2) << run.err << text;
    const auto probes = nlohmann::json::parse(run.out)["probes"];
    EXPECT_GT(probes.size(), 1U);
    for (const auto& probe : probes) EXPECT_GT(probe["used"], 10);
  }
}

TEST(Connect, ASensorWithoutAValueIsNamed) {
  for (const char* const line : {"0.011,nan,0.012", "0.011,,0.012", "0.011,N/A,0.012"}) {
    const TemporaryFolder folder;
    const LinePrinter hand(line, 115200, {.header = "thumb_N,index_N,palm_N"});
    const auto connected =
        run_program({"connect", hand.name(), "--yes", "--out", folder.path("s.toml")});
    EXPECT_EQ(connected.exit_code, 0) << connected.err << connected.out;
    EXPECT_TRUE(has(connected.out, "measures: thumb 0.011 N index no value palm 0.012 N"))
        << connected.out;
    EXPECT_TRUE(has(connected.out, "values of index_N: it had none; check its sensor"))
        << connected.out;
  }
}

TEST(Recognition, ASensorThatReadsZeroIsOneOfSeveral) {
  std::vector<std::string> lines;
  for (int k = 0; k < 50; ++k) {
    lines.push_back(std::to_string(10'000 * k) + ",0.000,0.437,0." + std::to_string(100 + k));
  }
  const auto readings = readings_of_lines(lines, 0.5);
  ASSERT_FALSE(readings.empty());
  EXPECT_EQ(readings[0].columns, "time_us,force1_N,force2_N,force3_N");
}

TEST(Recognition, NamesClocksAndCountersByTheirGrowth) {
  std::vector<std::string> lines;
  for (int k = 0; k < 50; ++k) {
    lines.push_back(std::to_string(7000 + 10 * k) + "," + std::to_string(k) + ",0.5");
  }
  const auto readings = readings_of_lines(lines, 0.5);
  ASSERT_FALSE(readings.empty());
  EXPECT_NE(readings[0].options().find("columns=time_ms,seq,force_N"), std::string::npos)
      << readings[0].options();
}

}  // namespace
}  // namespace merkel
