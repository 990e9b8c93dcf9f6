#include <algorithm>
#include <cmath>
#include <sstream>

#include <gtest/gtest.h>

#include "tests/temporary_folder.hpp"
#include "tests/tools/program.hpp"

namespace merkel {
namespace {

/// The numbers of a CSV table, without its header.
std::vector<std::vector<double>> table(const std::string& text) {
  std::vector<std::vector<double>> rows;
  std::istringstream lines(text);
  std::string line;
  std::getline(lines, line);
  while (std::getline(lines, line)) {
    std::istringstream fields(line);
    std::string field;
    rows.emplace_back();
    while (std::getline(fields, field, ',')) {
      rows.back().push_back(field == "true" ? 1.0 : field == "false" ? 0.0 : std::stod(field));
    }
  }
  return rows;
}

TEST(Inspect, ContactOfThePapersPress) {
  const auto run = run_program({"inspect", "contact", "--radius-mm", "2", "--depth-mm", "1.5"});
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_EQ(run.out.substr(0, run.out.find('\n')),
            "contact_radius_mm,force_N,peak_pressure_kPa,depth_mm,radius_ratio,sphere_force_error,"
            "layer_ratio,layer_force_error,valid");
  const auto rows = table(run.out);
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_NEAR(rows[0][0], std::sqrt(3.0), 1e-10);
  EXPECT_NEAR(rows[0][1], 0.45345, 5e-6);
  EXPECT_NEAR(rows[0][2], 72.169, 5e-4);
  EXPECT_EQ(rows[0][8], 0.0);
  EXPECT_NE(run.err.find("a/R = 0.866, limit 0.3"), std::string::npos);
}

TEST(Inspect, ContactFromForceIsItsInverse) {
  const auto run =
      run_program({"inspect", "contact", "--radius-mm", "2", "--force-N", "0.453451354873"});
  EXPECT_NEAR(table(run.out)[0][3], 1.5, 1e-9);
}

TEST(Inspect, FieldHasARowForEachPoint) {
  const auto run = run_program({"inspect", "field", "--radius-mm", "2", "--depth-mm", "1.5",
                                "--r-mm", "0,1,2", "--z-mm", "0.65,1"});
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_EQ(run.out.substr(0, run.out.find('\n')),
            "r_mm,z_mm,sigma_r_kPa,sigma_theta_kPa,sigma_z_kPa,tau_rz_kPa,sed_kPa");
  const auto rows = table(run.out);
  ASSERT_EQ(rows.size(), 6U);
  EXPECT_NEAR(rows[0][6], 6.5786, 1e-4);
}

TEST(Inspect, PrintedFieldIsThePointLoadAtTheDisplacement) {
  const auto run = run_program(
      {"inspect", "field", "--radius-mm", "5", "--depth-mm", "1", "--r-mm", "1,2", "--printed"});
  const auto rows = table(run.out);
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_NEAR(rows[0][1], 0.9, 1e-9);  // U(1) = d(1 − r²/2a²)
}

TEST(Inspect, ASolvedTipHasAFieldAndAForce) {
  const TemporaryFolder folder;
  const std::string bars = folder.file("s.toml", "[probe]\ntip = \"bars\"\n");
  const auto field = run_program(
      {"inspect", "field", "--scene", bars, "--depth-mm", "1", "--r-mm", "11.5", "--z-mm", "0.65"});
  EXPECT_NEAR(table(field.out)[0][6], 0.340, 0.01);
  const auto contact = run_program({"inspect", "contact", "--scene", bars, "--depth-mm", "1"});
  EXPECT_EQ(contact.out.substr(0, contact.out.find('\n')),
            "depth_mm,force_N,contact_mm2,peak_pressure_kPa,largest_sed_kPa,pixel_mm");
  const auto rows = table(contact.out);
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_EQ(rows[0][0], 1.0);
  EXPECT_NEAR(rows[0][1], 3.112, 0.02);
  EXPECT_NEAR(rows[0][2], 300.0, 15.0);
  EXPECT_NE(contact.err.find("contact of the tip \"bars\" solved on"), std::string::npos)
      << contact.err;
  // By force, on layers.
  const std::string cone = folder.file("c.toml",
                                       "[probe]\ntip = \"cone\"\nangle_deg = 120\ndiameter_mm = 4\n"
                                       "[[skin.layer]]\nthickness_mm = 4\nE_kPa = 100\n");
  const auto force = run_program({"inspect", "contact", "--scene", cone, "--force-N", "0.1"});
  EXPECT_NEAR(table(force.out)[0][1], 0.1, 0.001) << force.err;
  // Without a depth or force: all depths.
  EXPECT_GT(table(run_program({"inspect", "contact", "--scene", cone}).out).size(), 10U);
  // The table is written even where it cannot be drawn.
  const auto drawn = run_program(
      {"inspect", "contact", "--scene", cone, "--depth-mm", "0.5", "--draw", folder.path("drawn")});
  const auto pixels = table(read_file(folder.path("drawn/contact.csv")));
  EXPECT_GT(pixels.size(), 1000U);
  // Its pressures have the force of the press, in its middle.
  const auto press = table(drawn.out).at(0);
  double force_mN = 0.0;
  double moment_mN_mm = 0.0;
  for (const auto& pixel : pixels) {
    force_mN += pixel[3] * press[5] * press[5];
    moment_mN_mm += pixel[3] * press[5] * press[5] * pixel[0];
  }
  EXPECT_NEAR(force_mN / (1e3 * press[1]), 1.0, 0.01);
  EXPECT_NEAR(moment_mN_mm / force_mN, 0.0, 0.01);
}

TEST(Inspect, NeuronFiresAtThePublishedRates) {
  // MODEL: rates at I = 6, 10, 20, 30, 50, 100 are 58, 70, 87, 99, 118, 148 Hz.
  const std::vector<std::pair<const char*, double>> published = {
      {"6", 58.0}, {"10", 70.0}, {"20", 87.0}, {"30", 99.0}, {"50", 118.0}, {"100", 148.0}};
  for (const auto& [current, rate] : published) {
    const auto rows = table(
        run_program({"inspect", "neuron", "--current", current, "--duration-ms", "2000"}).out);
    ASSERT_GT(rows.size(), 50U);
    const double period_ms = (rows.back()[1] - rows[20][1]) / static_cast<double>(rows.size() - 21);
    EXPECT_NEAR(1000.0 / period_ms, rate, 1.0) << current;
  }
}

TEST(Inspect, NeuronTakesRampsMethodsAndSettings) {
  const auto ramp =
      table(run_program({"inspect", "neuron", "--ramp", "50,60,150,160,20", "--duration-ms", "300",
                         "--method", "rk4", "--step-us", "10", "--set", "gCaL=0"})
                .out);
  ASSERT_GT(ramp.size(), 5U);
  EXPECT_GT(ramp.front()[1], 50.0);
  EXPECT_LT(ramp.back()[1], 165.0);
}

TEST(Inspect, NeuronThatBlowsUpSaysSo) {
  const auto run =
      run_program({"inspect", "neuron", "--current", "10", "--method", "rk4", "--step-us", "200"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_NE(run.err.find("reduce --step-us"), std::string::npos);
}

TEST(Inspect, PrintsTheReceptorsAndAfferentsThatTheModelHas) {
  const auto receptors = table(run_program({"inspect", "receptors", "goodwin"}).out);
  ASSERT_EQ(receptors.size(), 12'600U);
  EXPECT_EQ(receptors.front()[3], 1.0);
  EXPECT_EQ(receptors.back()[3], 450.0);
  const auto afferents = table(run_program({"inspect", "afferents", "goodwin"}).out);
  ASSERT_EQ(afferents.size(), 450U);
  for (const auto& afferent : afferents) {
    EXPECT_EQ(afferent[3], 1.4);
    EXPECT_EQ(afferent[4], 28.0);
    EXPECT_EQ(afferent.at(5), 0.0);  // a single patch without a name
  }

  const TemporaryFolder folder;
  const std::string scene = folder.file(
      "s.toml", "preset = \"goodwin\"\n[receptors]\ncentres_mm = [[15, 10], [17, 9]]\n");
  EXPECT_EQ(table(run_program({"inspect", "receptors", scene}).out).size(), 56U);
  const auto centres = table(run_program({"inspect", "afferents", scene}).out);
  ASSERT_EQ(centres.size(), 2U);
  EXPECT_EQ(centres[1][1], 17.0);
  EXPECT_EQ(centres[1][2], 9.0);
  const auto hand = run_program({"inspect", "afferents", "hand"});
  EXPECT_NE(hand.out.find("neuron,x_mm,y_mm,field_radius_mm,receptors,patch\n"), std::string::npos);
  EXPECT_NE(hand.out.find(",palm\n"), std::string::npos);
}

TEST(Inspect, ReceptorsAreThoseOfTheScene) {
  const auto rows = table(run_program({"inspect", "receptors"}).out);
  ASSERT_EQ(rows.size(), 450U);
  EXPECT_EQ(rows[0][0], 1.0);
  EXPECT_TRUE(std::all_of(rows.begin(), rows.end(), [](const auto& row) {
    return row[1] >= 0.0 && row[1] <= 30.0 && row[2] >= 0.0 && row[2] <= 20.0 && row[3] >= 1.0 &&
           row[3] <= 20.0;
  }));
}

TEST(Inspect, FieldTakesBothSidesOfTheAxis) {
  const auto both = run_program({"inspect", "field", "--radius-mm", "2", "--depth-mm", "1",
                                 "--r-mm", "-1.5,1.5", "--z-mm", "0.65"});
  EXPECT_EQ(both.exit_code, 0) << both.err;
  const auto rows = table(both.out);
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[0][0], -1.5);
  EXPECT_EQ(rows[0][6], rows[1][6]);
  EXPECT_EQ(rows[0][5], -rows[1][5]);
}

TEST(Inspect, FieldOfAnExactLayerIsItsOwn) {
  const TemporaryFolder folder;
  const std::string scene = folder.file("layer.toml", "[skin]\nthickness_mm = 4\n");
  const auto run = run_program({"inspect", "field", "--scene", scene, "--radius-mm", "5",
                                "--depth-mm", "1", "--r-mm", "0", "--z-mm", "0.65"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const auto half_space = run_program(
      {"inspect", "field", "--radius-mm", "5", "--depth-mm", "1", "--r-mm", "0", "--z-mm", "0.65"});
  EXPECT_GT(table(run.out)[0][6], 2.0 * table(half_space.out)[0][6]);
  const auto refused = run_program(
      {"inspect", "field", "--scene", scene, "--depth-mm", "1", "--r-mm", "0", "--z-mm", "5"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("less than the depth of the bone, 4 mm"), std::string::npos)
      << refused.err;
}

TEST(Inspect, WrongUseIsExplained) {
  for (const auto& [arguments, sentence] :
       std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"inspect", "contact", "--radius-mm", "-2", "--depth-mm", "1"},
            "probe.radius_mm must be a positive number"},
           {{"inspect", "contact", "--radius-mm", "2"}, "give either --depth-mm or --force-N"},
           {{"inspect", "contact", "--force-N", "10"}, "more than the sphere's radius"},
           {{"inspect", "field", "--depth-mm", "1", "--r-mm", "1"}, "give --z-mm, or --printed"},
           {{"inspect", "neuron"}, "--current or --ramp must be given"},
           {{"inspect", "neuron", "--current", "5", "--method", "euler"},
            "must be one of forward_euler"},
           {{"inspect", "neuron", "--current", "5", "--set", "gX=1"}, "g_CaL"},
           {{"inspect"}, "a command is missing: merkel inspect --help"},
           {{}, "merkel: a command is missing: merkel --help"},
           {{"nothing"}, ""},
           {{"inspect", "field", "--r-mm", "-1"}, "give either --depth-mm or --force-N"}}) {
    const auto run = run_program(arguments);
    EXPECT_EQ(run.exit_code, 2);
    EXPECT_NE(run.err.find(sentence), std::string::npos) << run.err;
    EXPECT_TRUE(run.out.empty());
  }
}

}  // namespace
}  // namespace merkel
