// Surfaces that slide under the finger, as scenes.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>
#include <vector>

#include <gtest/gtest.h>

#include "core/scene/tactile_model.hpp"
#include "realtime/threads/spinning_team.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/program.hpp"
#include "tools/scene/scene_file.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;

constexpr double kPeriod_mm = 3.2;
const std::string kDots = "tools/examples/dots_scanned.toml";

/// Slides the example's dots under the finger at 40 mm/s and calls `spiked` for each spike with the
/// place of the surface.
template <class Spiked>
void scan(TactileModel& model, int ticks, double y_mm, Spiked spiked) {
  model.reset();
  for (int tick = 0; tick < ticks; ++tick) {
    const ContactInput input{
        .force_mN = 500.0 * std::min(1.0, tick / 150.0), .x_mm = 0.04 * tick, .y_mm = y_mm};
    for (const SpikeEvent& spike : model.step({&input, 1}, milliseconds{tick})) {
      spiked(spike, tick, input);
    }
  }
}

TactileModel dots_model() {
  const auto scene = read_scene(kDots);
  EXPECT_TRUE(scene) << scene.error().sentence;
  TactileModel::Parameters parameters = scene->model;
  parameters.indenters[0].control = Indenter::Control::kForce;
  return std::move(*TactileModel::create(parameters));
}

TEST(SlidingSurface, ARateMapOfScannedDotsShowsTheDots) {
  TactileModel model = dots_model();
  constexpr std::size_t kBins = 8;
  constexpr std::size_t kPasses = 4;
  std::vector<std::vector<double>> map(model.neurons(), std::vector<double>(kPasses * kBins));
  for (std::size_t pass = 0; pass < kPasses; ++pass) {
    scan(model, 720, 10.0 + kPeriod_mm * static_cast<double>(pass) / kPasses,
         [&](const SpikeEvent& spike, int tick, const ContactInput& input) {
           if (tick < 240) return;
           const double phase = std::fmod(input.x_mm, kPeriod_mm) / kPeriod_mm;
           const auto bin = std::min(static_cast<std::size_t>(phase * kBins), kBins - 1);
           ++map[spike.neuron - 1][pass * kBins + bin];
         });
  }
  const auto sum = [](const std::vector<double>& values) {
    double total = 0.0;
    for (const double value : values) total += value;
    return total;
  };
  const auto& best = *std::max_element(
      map.begin(), map.end(), [&](const auto& a, const auto& b) { return sum(a) < sum(b); });
  ASSERT_GT(sum(best), 60.0);
  std::vector<double> sorted = best;
  std::sort(sorted.begin(), sorted.end());
  const auto mean_of = [&](std::size_t first, std::size_t last) {
    return sum({sorted.begin() + static_cast<std::ptrdiff_t>(first),
                sorted.begin() + static_cast<std::ptrdiff_t>(last)}) /
           static_cast<double>(last - first);
  };
  // The eighth of the period under the dot against the quarter farthest from all dots.
  EXPECT_GT(mean_of(28, 32), 4.0 * mean_of(0, 8) + 2.0);
}

TEST(SlidingSurface, ThreadsDoNotChangeASpike) {
  TactileModel model = dots_model();
  std::vector<SpikeEvent> spikes[2];
  const auto run = [&](std::vector<SpikeEvent>& into) {
    scan(model, 400, 10.4,
         [&](const SpikeEvent& spike, int, const ContactInput&) { into.push_back(spike); });
  };
  run(spikes[0]);
  const auto team = SpinningTeam::create(2);
  ASSERT_TRUE(team) << team.error().sentence;
  model.share_work(team->get());
  run(spikes[1]);
  ASSERT_GT(spikes[0].size(), 40U);
  EXPECT_TRUE(spikes[0] == spikes[1]);
}

TEST(SlidingSurface, ARecordedSessionReplaysItsSpikes) {
  const TemporaryFolder folder;
  const std::string session = folder.path("dots.xdf");
  const auto run = run_program({"run", kDots, "--fast", "--duration-s", "0.7", "--sink",
                                "xdf:" + session, "--sink", "csv:" + folder.path("a.csv")});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto replay = run_program({"replay", session, "--sink", "csv:" + folder.path("b.csv")});
  EXPECT_EQ(replay.exit_code, 0) << replay.err;
  EXPECT_GT(read_file(folder.path("a.csv")).size(), 1000U);
  EXPECT_EQ(read_file(folder.path("a.csv")), read_file(folder.path("b.csv")));
}

TEST(SlidingSurface, ExamplesRunAndSayHowTheContactIsSolved) {
  for (const char* const name : {"dots_scanned", "braille_line", "letter_scanned"}) {
    const auto run = run_program(
        {"run", std::string("tools/examples/") + name + ".toml", "--fast", "--duration-s", "0.6"});
    EXPECT_EQ(run.exit_code, 0) << name << run.err;
    EXPECT_NE(run.out.find("contact of the surface solved at 250 Hz"), std::string::npos)
        << run.out;
    EXPECT_NE(run.out.find("it lags the probe by 8 ms"), std::string::npos) << name;
    EXPECT_EQ(run.out.find("Remedy"), std::string::npos) << run.out;
  }
}

TEST(SlidingSurface, InspectPressesItAsTheLoopDoes) {
  const TemporaryFolder folder;
  const std::string finger =
      "[skin]\nradius_mm = 7\napex_mm = [3, 4]\n[[probe]]\nradius_mm = inf\n";
  const std::string plate = folder.file("plate.toml", finger);
  const std::string surface = folder.file("surface.toml", finger + "surface = true\n");
  const auto numbers = [](const std::string& part, const std::string& scene, const char* press,
                          const char* value) {
    std::vector<std::string> arguments{"inspect", part, "--scene", scene, press, value};
    if (part == "field") arguments.insert(arguments.end(), {"--r-mm", "0.5", "--z-mm", "0.65"});
    const auto run = run_program(arguments);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    std::vector<double> row;
    std::istringstream fields(run.out.substr(run.out.find('\n') + 1));
    for (double number = 0.0; fields >> number; fields.ignore()) row.push_back(number);
    return row;
  };
  const auto closed = numbers("contact", plate, "--depth-mm", "0.6");
  const auto solved = numbers("contact", surface, "--depth-mm", "0.6");
  ASSERT_GE(std::min(closed.size(), solved.size()), 4U);
  EXPECT_EQ(solved[0], 0.6);
  EXPECT_NEAR(solved[1] / closed[1], 1.0, 0.005);
  EXPECT_NEAR(solved[2] / (std::numbers::pi * closed[0] * closed[0]), 1.0, 0.05);
  EXPECT_NEAR(solved[3] / closed[2], 1.0, 0.02);
  EXPECT_NEAR(numbers("contact", surface, "--force-N", "0.3")[0],
              numbers("contact", plate, "--force-N", "0.3")[3], 0.005);
  EXPECT_NEAR(numbers("field", surface, "--depth-mm", "0.6").back() /
                  numbers("field", plate, "--depth-mm", "0.6").back(),
              1.0, 0.01);
}

TEST(SlidingSurface, SaysWhatItNeeds) {
  const std::string dots =
      "[[probe]]\ntip = \"dots\"\ndots_mm = [[0, 0]]\nsurface = true\nrelief_mm = 0.5\n";
  const std::string skin = "preset = \"goodwin\"\n[skin]\napex_mm = [15, 10]\n";
  const auto error = [](const std::string& text) {
    const auto scene = parse_scene(text, "s.toml");
    if (!scene) return scene.error().sentence;
    const auto model = TactileModel::create(scene->model);
    return model ? std::string() : model.error().key + " " + model.error().reason;
  };
  EXPECT_EQ(error(skin + dots), "");
  EXPECT_NE(error("preset = \"goodwin\"\n" + dots).find("skin.apex_mm is missing"),
            std::string::npos);
  EXPECT_NE(error(dots).find("skin.radius_mm must be finite"), std::string::npos);
  EXPECT_NE(error(skin + dots + "[[probe]]\n").find("must press alone on its patch"),
            std::string::npos);
  EXPECT_NE(error(skin + "[[probe]]\nsurface = true\n").find("probe.radius_mm must be inf"),
            std::string::npos);
  EXPECT_EQ(error(skin + "[[probe]]\nsurface = true\nradius_mm = inf\n"), "");
  EXPECT_NE(error(skin + dots + "period_x_mm = 3.2\nperiod_y_mm = 3.201\n")
                .find("probe.deepest_mm gives a contact with too many pixels"),
            std::string::npos);
  EXPECT_NE(error(skin + dots + "diameter_mm = 0.1\n").find("enlarge that part"),
            std::string::npos);
  EXPECT_NE(error(skin + dots + "period_x_mm = 0.2\n").find("make the part smaller"),
            std::string::npos);
  EXPECT_NE(error(skin + dots + "[loop]\ntick_us = 100\n").find("loop.tick_us is too short"),
            std::string::npos);
}

TEST(SlidingSurface, ASurfaceThatIsTooSmallOrPressedTooDeepIsReported) {
  const std::string dots =
      "preset = \"goodwin\"\n[skin]\napex_mm = [15, 10]\n[[probe]]\ntip = \"dots\"\n"
      "dots_mm = [[0, 0]]\nsurface = true\n";
  const TemporaryFolder folder;
  const auto run = [&](const std::string& more) {
    std::ofstream(folder.path("s.toml")) << dots << more;
    return run_program({"run", folder.path("s.toml"), "--fast"}).out;
  };
  EXPECT_NE(run("uri = \"sim:scan?force_N=0.1&length_mm=4\"\n")
                .find("too small for its path: the finger's apex was beyond its end in"),
            std::string::npos);
  EXPECT_EQ(run("uri = \"sim:scan?force_N=0.1&length_mm=4\"\nperiod_x_mm = 3\n").find("too small"),
            std::string::npos);
  const std::string deep = "uri = \"sim:scan?depth_mm=2.5&length_mm=4\"\nrelief_mm = 0.5\n";
  EXPECT_NE(run(deep).find("Remedy: increase [probe] deepest_mm, or press less"),
            std::string::npos);
}

}  // namespace
}  // namespace merkel
