#include "tools/studies/score/skin_fit.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include <fmt/core.h>
#include <gtest/gtest.h>

#include "core/contact/hertz_contact.hpp"
#include "core/contact/tip_contact.hpp"
#include "core/math/normal_random.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/program.hpp"
#include "tools/scene/scene_file.hpp"

namespace merkel {
namespace {

const Indenter kPlate{.tip = SphereTip{std::numeric_limits<double>::infinity()}};
const Indenter kPin{.tip = PinTip{.diameter_mm = 6.35}};
const SkinParameters kFinger{.radius_mm = 7.0};
const std::vector<ForceAtDepth> kPlateForces = {
    {0.5, 37.0}, {1.0, 159.0}, {1.5, 395.0}, {2.0, 768.0}};
const std::vector<ForceAtDepth> kPinForces = {{0.5, 24.5}, {1.0, 76.5}, {2.0, 302.0}, {3.0, 957.0}};

/// A press on known skin, down and up again, with noise of `noise_mN`.
std::vector<ForceAtDepth> press_of(const Indenter& tip, const SkinParameters& skin,
                                   double noise_mN) {
  const TipContact contact(tip, skin);
  std::vector<ForceAtDepth> press;
  for (int k = -20; k <= 180; ++k) {
    const double depth = 2.0 - 0.02 * std::abs(k - 80);
    const double force = contact.press({.depth_mm = depth}).contact.force_mN;
    // During unloading, the force is smaller.
    press.push_back(
        {.depth_mm = depth,
         .force_mN = (k > 80 ? 0.8 : 1.0) * force +
                     noise_mN * normal_random(1, 0, static_cast<std::uint64_t>(k + 20))});
  }
  return press;
}

SkinParameters fingerpad() { return read_scene("tools/examples/fingerpad.toml")->model.skin; }

std::vector<ForceAtDepth> press_of(const Indenter& tip, double modulus_kPa, double stiffening_mm,
                                   double noise_mN) {
  SkinParameters skin = kFinger;
  skin.stiffening_mm = stiffening_mm;
  const double nu = skin.poisson_ratio;
  skin.epidermis_kPa = skin.dermis_kPa = modulus_kPa * (1.0 - nu * nu);
  return press_of(tip, skin, noise_mN);
}

TEST(SkinFit, FindsTheSkinThatMadeThePress) {
  for (const Indenter& tip : {kPlate, kPin}) {
    const auto fit = fit_skin(press_of(tip, 24.0, 1.65, 3.0), tip, kFinger);
    ASSERT_TRUE(fit) << fit.error().sentence;
    EXPECT_NEAR(fit->modulus_kPa, 24.0, 4.0 * fit->modulus_error * 24.0);
    EXPECT_FALSE(fit->by_pressure);
    EXPECT_NEAR(fit->stiffening, 1.65, 4.0 * fit->stiffening_error * 1.65);
    EXPECT_LT(fit->modulus_error, 0.05);
    EXPECT_LT(fit->stiffening_error, 0.05);
    EXPECT_GT(fit->r2, 0.99);
    EXPECT_NEAR(fit->rms_mN, 3.0, 1.0);
    EXPECT_TRUE(fit->unloaded);
    EXPECT_NEAR(fit->hysteresis, 0.2, 0.03);
  }
}

// A finger n times as stiff has n times the modulus and n times p1.
TEST(SkinFit, FindsModulusAndPressureOfSkinThatStiffensWithThePressure) {
  const SkinParameters finger = fingerpad();
  ASSERT_TRUE(std::isfinite(finger.stiffening_kPa));
  const double modulus_kPa = SkinMaterial(finger).reduced_modulus_kPa();
  for (const Indenter& tip : {kPlate, kPin}) {
    auto press = press_of(tip, finger, 1.0);
    for (ForceAtDepth& sample : press) sample.force_mN *= 2.0;
    const auto fit = fit_skin(press, tip, finger);
    ASSERT_TRUE(fit) << fit.error().sentence;
    EXPECT_TRUE(fit->by_pressure && fit->stiffens);
    EXPECT_NEAR(fit->modulus_kPa / modulus_kPa, 2.0, 0.04);
    EXPECT_NEAR(fit->stiffening / finger.stiffening_kPa, 2.0, 0.08);
    EXPECT_LT(fit->rms_weighted, 0.06);
    EXPECT_LT(fit->stiffening_error, 0.05);
  }
}

// Plates and a flat tip of 6.35 mm on human fingerpads, means of four subjects.
TEST(SkinFit, TheExampleFingerpadHasTheForcesOfHumanOnes) {
  struct Press {
    Indenter tip;
    std::vector<ForceAtDepth> mean;
  };
  const SkinParameters finger = fingerpad();
  for (const Press& press : {Press{kPlate, kPlateForces}, Press{kPin, kPinForces}}) {
    const TipContact contact(press.tip, finger);
    for (const ForceAtDepth& sample : press.mean) {
      EXPECT_NEAR(contact.press({.depth_mm = sample.depth_mm}).contact.force_mN / sample.force_mN,
                  1.0, 0.16)
          << sample.depth_mm << " mm";
    }
  }
}

TEST(SkinFit, SaysWhereThereIsNoStiffening) {
  const auto fit =
      fit_skin(press_of(kPlate, 100.0, -5.0, 0.0), kPlate, kFinger);  // the skin softens
  ASSERT_TRUE(fit);
  EXPECT_FALSE(fit->stiffens);
  EXPECT_TRUE(std::isinf(fit->stiffening));
  // At 2 mm, these stiffen by 0.7 and 2 thousandths.
  EXPECT_FALSE(fit_skin(press_of(kPlate, 100.0, 3000.0, 0.0), kPlate, kFinger)->stiffens);
  EXPECT_TRUE(fit_skin(press_of(kPlate, 100.0, 1000.0, 0.0), kPlate, kFinger)->stiffens);
}

// Published as 24 kPa and 1.65 mm, 15 kPa and 2.1 mm. Four samples each give standard errors of 8
// to 14 %.
TEST(SkinFit, AgreesWithThePublishedFingerpadsWithinItsStandardErrors) {
  struct Published {
    Indenter tip;
    std::vector<ForceAtDepth> press;
    double modulus_kPa, stiffening_mm;
  };
  for (const Published& known :
       {Published{kPlate, kPlateForces, 24.0, 1.65}, Published{kPin, kPinForces, 15.0, 2.1}}) {
    const auto fit = fit_skin(known.press, known.tip, kFinger);
    ASSERT_TRUE(fit);
    EXPECT_NEAR(fit->modulus_kPa / known.modulus_kPa, 1.0, fit->modulus_error);
    EXPECT_NEAR(fit->stiffening / known.stiffening_mm, 1.0, fit->stiffening_error);
    EXPECT_LT(fit->modulus_error, 0.15);
    EXPECT_LT(fit->stiffening_error, 0.15);
    EXPECT_GT(fit->r2, 0.98);
  }
}

// A load cell with relative gain errors: alternating ones are independent, a slow drift correlates
// neighbouring samples.
TEST(SkinFit, StandardErrorsCountSamplesThatErrAlikeAsFewer) {
  auto press = press_of(kPlate, 24.0, 1.65, 0.0);
  auto drifting = press;
  for (std::size_t k = 0; k < press.size(); ++k) {
    const auto at = static_cast<double>(k);
    press[k].force_mN *= 1.0 + (k % 2 == 0 ? 0.05 : -0.05);
    drifting[k].force_mN *= 1.0 + 0.05 * std::sin(at / 10.0);
  }
  const auto alternating = fit_skin(press, kPlate, kFinger);
  const auto slow = fit_skin(drifting, kPlate, kFinger);
  ASSERT_TRUE(alternating && slow);
  EXPECT_GT(slow->modulus_error, 2.0 * alternating->modulus_error);
  EXPECT_NEAR(slow->modulus_kPa / 24.0, 1.0, 3.0 * slow->modulus_error);
}

TEST(SkinFit, RefusesWhatIsNoPress) {
  EXPECT_NE(fit_skin({{0.5, 10.0}, {1.0, 20.0}}, kPlate, kFinger).error().sentence.find("needs 4"),
            std::string::npos);
  EXPECT_NE(fit_skin({{0.5, -1.0}, {1.0, -2.0}, {1.5, -3.0}, {2.0, -5.0}}, kPlate, kFinger)
                .error()
                .sentence.find("does not increase with the depth"),
            std::string::npos);
}

TEST(FitSkinCommand, WritesASceneWhosePressHasTheForce) {
  const TemporaryFolder folder;
  std::string trace = "time_s,depth_mm,force_N\n";
  double time = 0.0;
  for (const ForceAtDepth& sample : press_of(kPlate, 24.0, 1.65, 0.0)) {
    trace += fmt::format("{:.3f},{:.9g},{:.9g}\n", time += 0.01, sample.depth_mm,
                         1e-3 * sample.force_mN);
  }
  const auto run = run_program({"fit", "skin", "--trace", folder.file("p.csv", trace), "--plate",
                                "--out", folder.path("skin.toml")});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("E0 = 24 kPa"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("d1 = 1.65 mm"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("hysteresis: unloading loses 20 %"), std::string::npos) << run.out;
  const auto contact =
      run_program({"inspect", "contact", "--scene", folder.path("skin.toml"), "--depth-mm", "2"});
  EXPECT_EQ(contact.exit_code, 0) << contact.err;
  EXPECT_NE(contact.out.find(",0.8047"), std::string::npos) << contact.out;

  // Another scene keeps its other keys, also those of the same tables.
  const auto other =
      run_program({"fit", "skin",
                   folder.file("mine.toml",
                               "[skin]\nradius_mm = 9\npoisson_ratio = 0.45\n[probe]\nx_mm = 14\n"),
                   "--trace", folder.path("p.csv"), "--diameter-mm", "6.35", "--out",
                   folder.path("other.toml")});
  EXPECT_EQ(other.exit_code, 0) << other.err;
  const auto scene = read_scene(folder.path("other.toml"));
  ASSERT_TRUE(scene) << scene.error().sentence;
  EXPECT_EQ(scene->model.skin.radius_mm, 9.0);
  EXPECT_EQ(scene->model.skin.poisson_ratio, 0.45);
  EXPECT_EQ(scene->model.skin.epidermis_kPa, scene->model.skin.dermis_kPa);
  EXPECT_EQ(std::get<PinTip>(scene->model.indenters.front().tip).diameter_mm, 6.35);

  // A phantom that does not stiffen.
  std::string elastic = "time_s,depth_mm,force_N\n";
  for (int k = 0; k <= 100; ++k) {
    const double depth_mm = 0.02 * k;
    elastic += fmt::format("{:.3f},{:.9g},{:.9g}\n", 0.01 * k, depth_mm,
                           1e-3 * HertzContact(3.0, 9.0, 100.0).at_depth(depth_mm).force_mN);
  }
  const auto plain = run_program(
      {"fit", "skin", folder.file("nine.toml", "[skin]\nradius_mm = 9\n"), "--trace",
       folder.file("e.csv", elastic), "--radius-mm", "3", "--out", folder.path("plain.toml")});
  EXPECT_EQ(plain.exit_code, 0) << plain.err;
  EXPECT_NE(plain.out.find("no stiffening"), std::string::npos) << plain.out;
  EXPECT_NE(plain.out.find("E0 = 100 kPa"), std::string::npos) << plain.out;
  const auto used =
      run_program({"run", folder.path("plain.toml"), "--fast", "--duration-s", "0.1"});
  EXPECT_EQ(used.exit_code, 0) << used.err;

  const auto missing = run_program({"fit", "skin", "--trace", folder.path("p.csv")});
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_NE(missing.err.find("set the shape of the tip"), std::string::npos);
  const auto depth_only = run_program(
      {"fit", "skin", "--plate", "--trace", folder.file("d.csv", "time_s,depth_mm\n0,0\n1,1\n")});
  EXPECT_EQ(depth_only.exit_code, 2);
  EXPECT_NE(depth_only.err.find("has no column force_N"), std::string::npos);
}

TEST(FitSkinCommand, FitsTheStiffeningByPressureOfAScene) {
  const TemporaryFolder folder;
  std::string trace = "time_s,depth_mm,force_N\n";
  double time = 0.0;
  for (const ForceAtDepth& sample : press_of(kPin, fingerpad(), 0.0)) {
    trace += fmt::format("{:.3f},{:.9g},{:.9g}\n", time += 0.01, sample.depth_mm,
                         2e-3 * sample.force_mN);
  }
  const auto run = run_program({"fit", "skin", "tools/examples/fingerpad.toml", "--trace",
                                folder.file("p.csv", trace), "--diameter-mm", "6.35", "--out",
                                folder.path("skin.toml")});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("E*(p) = E0·(1 + p/p1): E0 = 10.53 kPa"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("p1 = 22 kPa"), std::string::npos) << run.out;
  const auto scene = read_scene(folder.path("skin.toml"));
  ASSERT_TRUE(scene) << scene.error().sentence;
  EXPECT_NEAR(scene->model.skin.dermis_kPa, 8.0, 1e-3);
  EXPECT_NEAR(scene->model.skin.stiffening_kPa, 22.0, 1e-2);
  EXPECT_TRUE(std::isinf(scene->model.skin.stiffening_mm));
}

TEST(SkinFitCommand, APressWithoutHysteresisLosesNoNegativeWork) {
  const TemporaryFolder folder;
  const auto run = run_program({"fit", "skin", "--trace", "tests/traces/taps.csv", "--radius-mm",
                                "2", "--out", folder.path("skin.toml")});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("unloading loses 0 % of the work"), std::string::npos) << run.out;
}

TEST(SkinFitCommand, TheSignOfTheForceIsThatOfTheScene) {
  const TemporaryFolder folder;
  std::string trace = "time_s,depth_mm,force_N\n";
  for (const ForceAtDepth& each : press_of(kPin, 24.0, 1.65, 0.0)) {
    trace += fmt::format("{},{:.4f},{:.6f}\n", std::count(trace.begin(), trace.end(), '\n'),
                         each.depth_mm, -1e-3 * each.force_mN);
  }
  const std::string press = folder.file("press.csv", trace);
  const auto fit = [&](const std::string& scene) {
    return run_program({"fit", "skin", scene, "--trace", press, "--diameter-mm", "6.35", "--out",
                        folder.path("skin.toml"), "--overwrite"});
  };
  const auto refused = fit("finger");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("[probe] invert_force of the scene"), std::string::npos)
      << refused.err;
  const auto advised =
      fit(folder.file("s.toml", "preset = \"finger\"\n[probe]\ninvert_force = true\n"));
  EXPECT_EQ(advised.exit_code, 0) << advised.err;
  EXPECT_NE(advised.out.find("R² = 1.0000"), std::string::npos) << advised.out;
}

}  // namespace
}  // namespace merkel
