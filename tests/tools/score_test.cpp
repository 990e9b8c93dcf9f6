#include "tools/studies/score/score.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <set>
#include <string>
#include <utility>
#include <variant>

#include <fmt/core.h>
#include <gtest/gtest.h>

#include "drivers/sinks/open_sink.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/text_has.hpp"
#include "tests/tools/program.hpp"
#include "tools/scene/scene_keys.hpp"
#include "tools/scene/scene_presets.hpp"
#include "tools/studies/score/array_responses.hpp"
#include "tools/studies/score/fit.hpp"
#include "tools/studies/score/pin_array.hpp"
#include "tools/studies/score/regularity.hpp"
#include "tools/studies/score/trials.hpp"

namespace merkel {
namespace {

// The targets of the preset, with few trials to keep the test fast.
TEST(Score, GoodwinMatchesTheRecordings) {
  const Recordings recordings = published_recordings();
  const auto scores = score_sets(preset_scene("goodwin")->model, recordings.sets, 10, {});
  ASSERT_TRUE(scores);
  ASSERT_EQ(scores->size(), 7U);
  EXPECT_LT((*scores)[0].rmse, 5.0);
  EXPECT_LT((*scores)[1].rmse, 5.0);
  EXPECT_LT((*scores)[2].rmse, 4.3);
  EXPECT_LT((*scores)[3].rmse, 4.0);
  EXPECT_NEAR((*scores)[4].predicted[0], 0.38, 0.04);
  EXPECT_NEAR((*scores)[5].predicted[0], 0.36, 0.06);  // not fitted
  EXPECT_FALSE(fitted_to(recordings.sets[5]));
  // A known error: recorded rates have reached their asymptote after a second.
  EXPECT_NEAR((*scores)[6].predicted[0], 0.2, 0.05);
  EXPECT_GT((*scores)[0].r2, 0.95);
  for (const double sd : (*scores)[1].count_sd) EXPECT_LT(sd, 1.0);
}

TEST(Score, TrialsAreOneAfferentWithDifferentNoise) {
  const Recordings recordings = published_recordings();
  const Stimulus& stimulus = recordings.sets[0].points[3].stimulus;
  auto trials = Trials::create(preset_scene("goodwin")->model, stimulus, 5);
  ASSERT_TRUE(trials);
  const auto first = trials->run(stimulus);
  ASSERT_EQ(first.size(), 5U);
  EXPECT_NE(first[0], first[1]);
  EXPECT_EQ(trials->run(stimulus), first);
  EXPECT_TRUE(trials->fits(stimulus));
  EXPECT_FALSE(trials->fits(recordings.sets[0].points[4].stimulus));
}

TEST(Score, AnswersCountInTheirWindows) {
  Stimulus rate;
  rate.settle_s = 1.0;
  rate.count_s = 2.0;
  const std::vector<std::vector<double>> trains = {{0.5, 1.0, 2.5, 3.0}, {1.5, 1.6, 1.7, 2.9}};
  EXPECT_EQ(answer_of(rate, trains).value, 1.5);
  EXPECT_EQ(answer_of(rate, trains).count_sd, 1.0);
  Stimulus decline;
  decline.ramp_s = 1.0;
  decline.count_s = 1.0;
  decline.decline_over_s = 2.0;
  EXPECT_EQ(answer_of(decline, {{1.1, 1.2, 1.3, 1.4, 2.2}}).value, 0.75);
}

TEST(Score, PeersArePublishedFiguresOrNone) {
  EXPECT_EQ(peers_of("curvature × force, 0.196 N").touchsim, 57.0);
  EXPECT_TRUE(std::isnan(peers_of("bar profile, 1 mm").ouyang));
}

TEST(Score, SkipsAFlatPlateOnFlatSkin) {
  const Recordings recordings = published_recordings();
  const auto scores = score_sets(preset_scene("paper")->model, {recordings.sets[0]}, 1, {});
  ASSERT_TRUE(scores) << scores.error().key << " " << scores.error().reason;
  EXPECT_EQ((*scores)[0].skipped, 1U);
  EXPECT_TRUE(std::isnan((*scores)[0].predicted[0]));
  EXPECT_TRUE(std::isfinite((*scores)[0].rmse));
}

TEST(Score, ExplainedVarianceRevealsAWrongGain) {
  const Recordings recordings = published_recordings();
  DataSet halved = recordings.sets[0];
  for (DataSet::Point& point : halved.points) point.measured *= 0.5;
  const auto scores = score_sets(preset_scene("goodwin")->model, {halved}, 3, {});
  ASSERT_TRUE(scores);
  EXPECT_GT((*scores)[0].r2, 0.95);
  EXPECT_LT((*scores)[0].R2, 0.0);
  EXPECT_TRUE(fitted_to(recordings.sets[0]));
  EXPECT_FALSE(fitted_to(halved));
}

// Recorded areas: 5.3 to 8.8 mm². Without the lowered array, 50 µm evoke no impulse.
TEST(Score, ReceptiveFieldsNeedTheArrayAroundThePin) {
  const auto scene = preset_scene("goodwin")->model;
  const Recordings recordings = published_recordings();
  const Recordings::FieldAreas& areas = recordings.field_areas.at(0);
  const auto found = field_areas(scene, areas, 10, 2);
  ASSERT_TRUE(found);
  for (std::size_t i = 0; i < areas.points.size(); ++i) {
    EXPECT_NEAR((*found)[i].area_mm2, areas.points[i].area_mm2, 3.0) << areas.points[i].depth_mm;
    EXPECT_LT((*found)[i].area_mm2, areas.points[i].area_mm2) << areas.points[i].depth_mm;
  }
  const auto bare = field_areas(scene, {.array = {.pins = 1}, .points = {{0.05, 5.3}}}, 10, 1);
  EXPECT_EQ((*bare)[0].area_mm2, 0.0);
}

// The soft finger is fitted to rates only: its fields and their linear growth follow.
TEST(Score, TheSoftFingerHasTheRecordedReceptiveFields) {
  const auto scene = preset_scene("finger")->model;
  Recordings recordings = published_recordings();
  recordings.sets.resize(2);
  const auto rates = score_sets(scene, recordings.sets, 10, {}, 2);
  ASSERT_TRUE(rates);
  EXPECT_LT(std::hypot((*rates)[0].rmse, (*rates)[1].rmse) / std::sqrt(2.0), 4.0);
  const Recordings::FieldAreas& areas = recordings.field_areas.at(0);
  const auto found = field_areas(scene, areas, 10, 2);
  ASSERT_TRUE(found);
  for (std::size_t i = 1; i < areas.points.size(); ++i) {
    EXPECT_NEAR((*found)[i].area_mm2, areas.points[i].area_mm2, 1.4) << areas.points[i].depth_mm;
    const double per_mm = (*found)[i].response / areas.points[i].depth_mm;
    EXPECT_NEAR(per_mm, 56.0, 7.0) << areas.points[i].depth_mm;
  }
}

// Recorded afferents respond to seven raised pins 0.20 times as much as to one. Wide receptive
// fields sum the pins; small ones at a smaller depth see the pressure even out below them.
TEST(Score, OnlySmallReceptiveFieldsAreSuppressedByNeighbouringPins) {
  auto scene = preset_scene("goodwin")->model;
  const Recordings recordings = published_recordings();
  ASSERT_EQ(recordings.surrounds.size(), 2U);
  const auto seven = [&](std::size_t background) {
    const auto ratios = surround_ratios(scene, recordings.surrounds[background], 10, 2);
    return ratios->at(1);
  };
  EXPECT_NEAR(seven(0), 1.30, 0.1);
  scene.patches.front().field = {};
  EXPECT_NEAR(seven(0), 2.6, 0.25);
  scene.skin.receptor_depth_mm = 0.5;
  scene.patches.front().field.radius_mm = 0.5;
  EXPECT_LT(seven(0), 0.6);
  EXPECT_NEAR(seven(1), seven(0), 0.05);
}

// Raising all pins is lowering the array: the contact is that of the deeper background.
TEST(Score, AnArrayWithAllPinsRaisedIsADeeperArray) {
  const auto scene = preset_scene("goodwin")->model;
  const PinArray shallow{.pins = 7, .background_mm = 1.0};
  const PinArray deep{.pins = 7, .background_mm = 1.25};
  const auto raised = PinArrayTrials::create(scene, shallow, 1)->field({7, 0.25});
  const auto lowered = PinArrayTrials::create(scene, deep, 1)->field({0, 0.0});
  EXPECT_NEAR(raised.force_mN(1.25) / lowered.force_mN(1.25), 1.0, 1e-4);
}

TEST(Fit, LeavesOutWhatIsKeptForACheck) {
  TactileModel::Parameters scene = preset_scene("goodwin")->model;
  std::vector<DataSet> sets = {published_recordings().sets[5]};
  EXPECT_EQ(fit(scene, sets, {"gain_Hz_per_kPa"}, 1, 10, {}).error().sentence,
            "the data file contains no rates or declines to fit");
}

TEST(Fit, EndsWhereItsProgressSaysSo) {
  TactileModel::Parameters scene = preset_scene("goodwin")->model;
  std::vector<DataSet> sets = {published_recordings().sets[0]};
  sets[0].points.resize(2);
  int asked = 0;
  const auto result =
      fit(scene, sets, {"gain_Hz_per_kPa"}, 4, 100'000, [&](double) { return ++asked < 5; });
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().sentence, "the fit was ended");
  EXPECT_EQ(asked, 5);
}

TEST(Fit, SaysWhatTheDataDoNotDetermine) {
  TactileModel::Parameters scene = preset_scene("goodwin")->model;
  std::vector<DataSet> sets = {published_recordings().sets[0]};
  sets[0].points.resize(2);
  std::vector<double> done;
  const auto result = fit(scene, sets, {"gain_Hz_per_kPa", "slow_weight", "fast_weight"}, 4, 30,
                          [&](double fraction) {
                            done.push_back(fraction);
                            return true;
                          });
  ASSERT_TRUE(result) << result.error().sentence;
  EXPECT_EQ(result->measurements, 2U);
  EXPECT_FALSE(result->determined());
  ASSERT_GT(done.size(), 10U);
  EXPECT_NEAR(done.front(), 1.0 / 30, 1e-12);
  EXPECT_TRUE(std::is_sorted(done.begin(), done.end()));
  EXPECT_LE(done.back(), 1.0);
}

TEST(Fit, RecoversTheParametersThatMadeTheData) {
  TactileModel::Parameters truth = preset_scene("goodwin")->model;
  truth.adaptation.gain_Hz_per_kPa = 24.0;
  truth.adaptation.slow_weight = 1.0;
  Recordings made = published_recordings();
  made.sets.resize(2);
  const auto scores = score_sets(truth, made.sets, 16, {});
  ASSERT_TRUE(scores);
  for (std::size_t s = 0; s < 2; ++s) {
    for (std::size_t i = 0; i < made.sets[s].points.size(); ++i) {
      made.sets[s].points[i].measured = (*scores)[s].predicted[i];
    }
  }
  TactileModel::Parameters scene = preset_scene("goodwin")->model;
  const auto result = fit(scene, made.sets, {"gain_Hz_per_kPa"}, 16, 60, {});
  ASSERT_TRUE(result) << result.error().sentence;
  EXPECT_LT(result->cost_after, result->cost_before);
  EXPECT_EQ(scene.adaptation.gain_Hz_per_kPa, result->parameters[0].after);
  scene.adaptation.slow_weight = 1.0;
  const auto again = fit(scene, made.sets, {"gain_Hz_per_kPa"}, 16, 60, {});
  ASSERT_TRUE(again);
  EXPECT_NEAR(scene.adaptation.gain_Hz_per_kPa, 24.0, 0.5);
  EXPECT_LT(again->cost_after, 0.3);
  EXPECT_LT(again->parameters[0].relative_error, 0.05);
}

TEST(Fit, RecoversTheRadiusOfAnAfferentsField) {
  TactileModel::Parameters truth = preset_scene("goodwin")->model;
  truth.patches.front().field.radius_mm = 0.6;
  Recordings made = published_recordings();
  made.sets.resize(1);
  const auto scores = score_sets(truth, made.sets, 8, {}, 2);
  ASSERT_TRUE(scores);
  for (std::size_t i = 0; i < made.sets[0].points.size(); ++i) {
    made.sets[0].points[i].measured = (*scores)[0].predicted[i];
  }
  TactileModel::Parameters scene = preset_scene("goodwin")->model;
  const auto result = fit(scene, made.sets, {"field_radius_mm"}, 8, 30, {}, 2);
  ASSERT_TRUE(result) << result.error().sentence;
  EXPECT_NEAR(scene.patches.front().field.radius_mm, 0.6, 0.02);
  scene.patches.front().layout = ReceptorLayout::kSubregions;
  EXPECT_NE(fit(scene, made.sets, {"field_radius_mm"}, 8, 30, {}).error().sentence.find("layout"),
            std::string::npos);
}

TEST(Fit, ThreadsChangeNoBitOfAScoreOrAFit) {
  const TactileModel::Parameters goodwin = preset_scene("goodwin")->model;
  Recordings recordings = published_recordings();
  recordings.sets.resize(3);
  const auto one = score_sets(goodwin, recordings.sets, 2, {}, 1);
  const auto three = score_sets(goodwin, recordings.sets, 2, {}, 3);
  ASSERT_TRUE(one && three);
  for (std::size_t s = 0; s < 3; ++s) {
    EXPECT_EQ((*one)[s].predicted, (*three)[s].predicted);
    EXPECT_EQ((*one)[s].rmse, (*three)[s].rmse);
  }
  recordings.sets.resize(1);
  std::vector<double> fitted;
  for (const std::size_t threads : {1U, 3U}) {
    TactileModel::Parameters scene = goodwin;
    scene.adaptation.gain_Hz_per_kPa *= 1.3;
    const auto result = fit(scene, recordings.sets, {"gain_Hz_per_kPa"}, 2, 12, {}, threads);
    ASSERT_TRUE(result);
    EXPECT_LT(result->cost_after, result->cost_before);
    fitted.push_back(scene.adaptation.gain_Hz_per_kPa);
  }
  EXPECT_EQ(fitted[0], fitted[1]);
}

TEST(Fit, EveryParameterOfANeuronHasItsOwnName) {
  TactileModel::Parameters model = preset_scene("goodwin")->model;
  std::set<std::string> names;
  std::set<const double*> places;
  for (const FitParameter& parameter : fit_parameters(model.kind())) {
    EXPECT_TRUE(names.insert(parameter.name).second) << parameter.name;
    places.insert(parameter.in(model));
  }
  EXPECT_EQ(places.size(), names.size());
}

TEST(Fit, RefusesWhatItCannotFit) {
  TactileModel::Parameters goodwin = preset_scene("goodwin")->model;
  const auto sets = published_recordings().sets;
  EXPECT_EQ(fit(goodwin, sets, {"fast_wieght"}, 1, 10, {}).error().sentence,
            "no parameter \"fast_wieght\" can be fitted; did you mean fast_weight?");
  TactileModel::Parameters paper = preset_scene("paper")->model;
  EXPECT_EQ(fit(paper, sets, {"gain_Hz_per_kPa"}, 1, 10, {}).error().sentence,
            "only neurons driven by energy density can be fitted: start from goodwin or finger");
}

TEST(ScoreCommand, WritesAReportTablesAndPictures) {
  const TemporaryFolder folder;
  const auto run =
      run_program({"score", "--trials", "3", "--skip-experiments", "--out", folder.path("s")});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("| curvature × force, 0.098 N | 7 | "), std::string::npos);
  EXPECT_NE(run.out.find("| 32.0 | 35.0 |"), std::string::npos);
  EXPECT_EQ(read_file(folder.path("s/score.md")), run.out);
  for (const char* name :
       {"curvature_force", "vibration", "adaptation", "rate_by_drive", "intervals"}) {
    EXPECT_EQ(read_file(folder.path("s/" + std::string(name) + ".png")).substr(1, 3), "PNG");
  }
  EXPECT_GT(read_file(folder.path("s/conditions.csv")).size(), 1000U);
}

TEST(ScoreCommand, TakesOtherRecordings) {
  const TemporaryFolder folder;
  const std::string data = folder.file("d.json", R"({
    "lateral_offset": {"cite": "a", "curvature_per_m": 340, "offset_mm": [0, 1, 3],
                       "rate_hz": {"15gwt_0.147N": [74, 40, 5]}},
    "bar_profile": {"cite": "b", "bar_widths_mm": [3], "position_mm": [0, 1.5, 4],
                    "rate_hz": {"0.5mm": [20, 60, 0]}}})");
  const auto run =
      run_program({"score", "--data", data, "--trials", "3", "--out", folder.path("s")});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("| lateral offset, 340 /m, 0.147 N | 3 |"), std::string::npos);
  EXPECT_NE(run.out.find("| bar profile, 0.5 mm | 3 |"), std::string::npos);
  EXPECT_EQ(read_file(folder.path("s/lateral_offset.png")).substr(1, 3), "PNG");
  EXPECT_EQ(read_file(folder.path("s/bar_profile.png")).substr(1, 3), "PNG");
  // An edge evokes more than the inside of a bar, and the far side least.
  const std::string table = read_file(folder.path("s/conditions.csv"));
  EXPECT_NE(table.find("bar_profile"), std::string::npos);
}

TEST(ScoreCommand, ASensorThatReportsCompressionAsNegativePressesToo) {
  const TemporaryFolder folder;
  static_cast<void>(
      folder.file("press.csv", "time_s,force_N\n0,0\n0.1,0\n0.2,-0.2\n0.9,-0.2\n1,0\n1.2,0\n"));
  const std::string data = folder.file("d.json", R"({
    "trials": [{"cite": "mine", "name": "one", "radius_mm": 3, "trace": "press.csv",
                "spike_times_s": [[0.2, 0.3]]}]})");
  const std::string scene =
      folder.file("s.toml", "preset = \"goodwin\"\n[[probe]]\ninvert_force = true\n");
  const auto run = run_program({"score", scene, "--data", data, "--trials", "2",
                                "--skip-experiments", "--out", folder.path("s")});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_TRUE(has(run.out, "| hold | 0.200 | 0.900 | 2.86 | 8")) << run.out;
  // Its session has the contact, but not the sign.
  const auto recorded =
      run_program({"run", scene, "--fast", "--probe", "replay:" + folder.path("press.csv"),
                   "--sink", "xdf:" + folder.path("press.xdf")});
  ASSERT_EQ(recorded.exit_code, 0) << recorded.err;
  const std::string of_session = folder.file("e.json", R"({
    "trials": [{"cite": "mine", "name": "one", "radius_mm": 3, "trace": "press.xdf",
                "spike_times_s": [[0.2, 0.3]]}]})");
  const auto refused = run_program({"score", "goodwin", "--data", of_session, "--trials", "2",
                                    "--skip-experiments", "--out", folder.path("t")});
  EXPECT_NE(refused.exit_code, 0);
  EXPECT_TRUE(has(refused.err, "set [probe] invert_force = true in the scene")) << refused.err;
  const auto advised = run_program({"score", scene, "--data", of_session, "--trials", "2",
                                    "--skip-experiments", "--out", folder.path("t")});
  EXPECT_EQ(advised.exit_code, 0) << advised.err;
}

TEST(ScoreCommand, TakesRecordedPressesWithTheirSpikes) {
  const TemporaryFolder folder;
  static_cast<void>(
      folder.file("press.csv", "time_s,force_N\n10,0\n10.1,0\n10.2,0.2\n10.9,0.2\n11,0\n11.2,0\n"));
  std::string spikes = "time_s,trial\n";
  for (int trial = 1; trial <= 3; ++trial) {
    for (int k = 0; k < 20; ++k) {
      spikes +=
          std::to_string(10.15 + 0.04 * k + 0.002 * trial) + "," + std::to_string(trial) + "\n";
    }
  }
  static_cast<void>(folder.file("spikes.csv", spikes));
  const std::string data = folder.file("d.json", R"({
    "trials": [{"cite": "mine", "name": "one", "radius_mm": 3, "trace": "press.csv",
                "spikes": "spikes.csv", "frequency_hz": 25},
               {"cite": "mine", "name": "two", "tip": "pin", "trace": "press.csv",
                "spike_times_s": [[10.2, 10.3], []]}]})");
  const auto run =
      run_program({"score", "--data", data, "--trials", "3", "--out", folder.path("s")});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  for (const char* part :
       {"### one: 3 recorded trials, 3 of the model", "| hold | 0.200 | 0.900 | 24.29",
        "Victor–Purpura", "van Rossum", "phase locking at 25 Hz (vector strength): recorded 0.967",
        "| one | 1 |", "### two: 2 recorded trials", "## Data of "}) {
    EXPECT_NE(run.out.find(part), std::string::npos) << part << "\n" << run.out;
  }
  EXPECT_EQ(run.out.find("goodwin was fitted"), std::string::npos);
  EXPECT_EQ(run.out.find("## Not fitted"), std::string::npos);
  EXPECT_EQ(read_file(folder.path("s/trials_2.png")).substr(1, 3), "PNG");
  EXPECT_GT(read_file(folder.path("s/psth.csv")).size(), 100U);
  const auto fitted = run_program({"fit", "--data", data, "--trials", "2", "--evaluations", "12",
                                   "--parameter", "gain_Hz_per_kPa", "--out", folder.path("f.toml"),
                                   "--report", folder.path("r")});
  EXPECT_EQ(fitted.exit_code, 0) << fitted.err;
  for (const char* part : {"Hz² before", "### one: 3 recorded trials, 2 of the model",
                           "| hold | 0.200 | 0.900 | 24.29", "Victor–Purpura", "van Rossum",
                           "phase locking at 25 Hz", "PSTH in bins of 20 ms"}) {
    EXPECT_NE(fitted.out.find(part), std::string::npos) << part << "\n" << fitted.out;
  }
  EXPECT_EQ(read_file(folder.path("r/fit.md")), fitted.out);
  EXPECT_EQ(read_file(folder.path("r/trials_2.png")).substr(1, 3), "PNG");
  EXPECT_NE(read_file(folder.path("r/trials.csv")).find("one,model,"), std::string::npos);
  // The spikes compared are those of the scene that was written.
  const auto scored = run_program(
      {"score", folder.path("f.toml"), "--data", data, "--trials", "2", "--out", folder.path("t")});
  EXPECT_EQ(scored.exit_code, 0) << scored.err;
  EXPECT_EQ(read_file(folder.path("t/trials.csv")), read_file(folder.path("r/trials.csv")));
  const auto again = run_program(
      {"fit", "--data", data, "--out", folder.path("g.toml"), "--report", folder.path("r")});
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_NE(again.err.find("r/trials.csv already exists"), std::string::npos) << again.err;
  EXPECT_FALSE(std::filesystem::exists(folder.path("g.toml")));
  const auto inside = run_program({"fit", "--data", data, "--trials", "1", "--evaluations", "10",
                                   "--parameter", "gain_Hz_per_kPa", "--out",
                                   folder.path("n/g.toml"), "--report", folder.path("n")});
  EXPECT_EQ(inside.exit_code, 0) << inside.err;
  EXPECT_TRUE(std::filesystem::exists(folder.path("n/g.toml")));
  const auto no_trials = run_program({"fit", "--report", folder.path("x")});
  EXPECT_EQ(no_trials.exit_code, 2);
  EXPECT_NE(no_trials.err.find("no section trials"), std::string::npos) << no_trials.err;
  const auto missing = run_program(
      {"score", "--data",
       folder.file("m.json",
                   R"({"trials": {"cite": "x", "trace": "no.csv", "spike_times_s": [[1]]}})"),
       "--out", folder.path("m")});
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_NE(missing.err.find("no.csv"), std::string::npos) << missing.err;
}

TEST(ScoreCommand, ATrialWithoutSpikesIsNotLeftOut) {
  const TemporaryFolder folder;
  static_cast<void>(folder.file("press.csv", "time_s,force_N\n0,0\n0.1,0.2\n0.9,0.2\n1,0\n"));
  const auto score = [&](const std::string& spikes, const char* out) {
    const std::string data = folder.file(
        "d.json",
        R"({"trials": [{"cite": "x", "radius_mm": 3, "trace": "press.csv", )" + spikes + "}]}");
    return run_program(
        {"score", "--data", data, "--trials", "1", "--out", folder.path(out), "--overwrite"});
  };
  static_cast<void>(folder.file("spikes.csv", "time_s,trial\n0.3,1\n0.4,3\n"));
  const auto refused = score(R"("spikes": "spikes.csv")", "s");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_TRUE(has(refused.err, "spikes of the trials 1 and 3, but none of trial 2")) << refused.err;
  const auto advised = score(R"("spike_times_s": [[0.3], [], [0.4]])", "s");
  EXPECT_EQ(advised.exit_code, 0) << advised.err;
  EXPECT_TRUE(has(advised.out, "3 recorded trials")) << advised.out;
}

TEST(ScoreCommand, ThePhasesOfAPressAreThoseOfItsContact) {
  const TemporaryFolder folder;
  std::string trace = "time_s,force_N\n";
  for (int i = 0; i <= 300; ++i) {
    const double press_N = std::clamp(0.01 * std::min(i - 100, 220 - i), 0.0, 0.2);
    trace += fmt::format("{:.2f},{:.3f}\n", 0.01 * i,
                         press_N > 0.0 ? press_N
                         : i % 2 == 0  ? 0.003
                                       : -0.003);
  }
  const std::string press = folder.file("press.csv", trace);
  const std::string scene =
      folder.file("gauge.toml", "preset = \"goodwin\"\n[probe]\nuri = \"replay:" + press +
                                    "\"\ncontact_N = 0.012\n");
  ASSERT_EQ(
      run_program({"run", scene, "--fast", "--sink", "xdf:" + folder.path("press.xdf")}).exit_code,
      0);
  // Of a trace it is decided as in a run of the scene; of a session it is recorded.
  for (const auto& [scored, file] :
       {std::pair<std::string, std::string>{scene, "press.csv"}, {"goodwin", "press.xdf"}}) {
    const std::string data =
        folder.file("d.json", R"({"trials": {"cite": "mine", "name": "one", "trace": ")" + file +
                                  R"(", "spike_times_s": [[1.5, 1.6], [1.5]]}})");
    const auto run = run_program({"score", scored, "--data", data, "--trials", "1", "--overwrite",
                                  "--out", folder.path("s")});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    for (const char* row :
         {"| ramp | 1.020 | 1.190 |", "| hold | 1.190 | 2.010 |", "| release | 2.010 | 2.190 |"}) {
      EXPECT_NE(run.out.find(row), std::string::npos) << file << "\n" << run.out;
    }
  }
}

/// A session whose run began at 1000 s of its clock: 0.1 s of rise, 0.7 s of hold.
void record_press(const std::string& path) {
  SinkSetup setup{.neurons = 0, .run = {}};
  setup.run.probes = {{.uri = "p", .name = "p", .channels = ProbeSample::kForce}};
  const std::chrono::seconds start{1000};
  auto sink = open_sink("xdf:" + path, setup);
  ASSERT_TRUE(sink) << sink.error().sentence;
  ASSERT_TRUE((*sink)->begin({.start = start}));
  std::vector<DeliveredSample> samples;
  for (int i = 0; i <= 120; ++i) {
    samples.push_back(
        {.sample = {.time = start + std::chrono::milliseconds{50 + 10 * i},
                    .force_mN = std::clamp(20.0 * std::min(i - 10, 100 - i), 0.0, 200.0),
                    .channels = ProbeSample::kForce}});
  }
  ASSERT_TRUE((*sink)->write({.samples = samples}));
  ASSERT_TRUE((*sink)->close());
}

TEST(ScoreCommand, SpikesOfASessionCountFromItsStart) {
  const TemporaryFolder folder;
  record_press(folder.path("press.xdf"));
  const auto score = [&folder](const std::string& spikes) {
    const std::string trials = R"({"cite": "mine", "name": "one", "trace": "press.xdf", )";
    const std::string data =
        folder.file("d.json", "{\"trials\": " + trials + "\"spike_times_s\": " + spikes + "}}");
    return run_program(
        {"score", "--data", data, "--trials", "1", "--overwrite", "--out", folder.path("s")});
  };
  // 0.25 s after the start is 0.2 s after the first sample.
  const auto run = score("[[0.24, 0.26, 0.4, 0.8, 1.2]]");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("| hold | 0.200 | 0.900 | 4.29 |"), std::string::npos) << run.out;
  const auto refused = score("[[1000.3, 1000.9], []]");
  EXPECT_EQ(refused.exit_code, 2);
  for (const char* part :
       {"one: its spikes are from 1000.3 to 1000.9 s", "none is within its trace",
        "press.xdf, from 0.05 to 1.25 s: count both from the same zero"}) {
    EXPECT_NE(refused.err.find(part), std::string::npos) << part << "\n" << refused.err;
  }
  EXPECT_EQ(score("[[], []]").exit_code, 0);
}

TEST(ScoreCommand, BadDataIsRefusedBeforeAnythingIsWritten) {
  const TemporaryFolder folder;
  const std::string data =
      folder.file("d.json", R"({"curvature_force": {"cite": "a", "curvature_per_m": [1],
                    "rate_hz": {"-0.1N": [1]}}})");
  const auto run = run_program({"score", "--data", data, "--out", folder.path("s")});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_NE(run.err.find("must have a positive number before N"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(folder.path("s")));
}

TEST(FitCommand, WritesASceneThatRuns) {
  const TemporaryFolder folder;
  const auto run =
      run_program({"fit", "--trials", "2", "--evaluations", "12", "--parameter", "gain_Hz_per_kPa",
                   "--parameter", "noise", "--out", folder.path("f.toml")});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("Hz² before"), std::string::npos);
  EXPECT_NE(run.out.find("condition of the cost's curvature"), std::string::npos);
  const auto scene = read_scene(folder.path("f.toml"));
  ASSERT_TRUE(scene) << scene.error().sentence;
  EXPECT_EQ(scene->model.kind(), NeuronKind::kIntegrateAndFire);
  const auto used = run_program({"run", folder.path("f.toml"), "--fast", "--duration-s", "0.1"});
  EXPECT_EQ(used.exit_code, 0) << used.err;
}

TEST(FitCommand, StartsFromASceneFileAndKeepsItsOtherKeys) {
  const TemporaryFolder folder;
  const std::string start =
      folder.file("mine.toml",
                  "preset = \"finger\"\n[skin]\nradius_mm = 9\n[afferent]\ngain_Hz_per_kPa = 12.5\n"
                  "fast_weight = 40\n[[sink]]\nuri = \"csv:spikes.csv\"\n");
  const auto run = run_program({"fit", start, "--trials", "2", "--evaluations", "12", "--parameter",
                                "gain_Hz_per_kPa", "--out", folder.path("f.toml")});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("| gain_Hz_per_kPa | 12.5 |"), std::string::npos) << run.out;
  auto before = read_scene(start);
  const auto after = read_scene(folder.path("f.toml"));
  ASSERT_TRUE(before && after);
  EXPECT_NE(after->model.adaptation.gain_Hz_per_kPa, 12.5);
  EXPECT_EQ(after->sinks, before->sinks);
  // But for the fitted key it is the same scene.
  before->model.adaptation.gain_Hz_per_kPa = after->model.adaptation.gain_Hz_per_kPa;
  EXPECT_EQ(scene_text(*after), scene_text(*before));

  const auto paper = run_program({"fit", "paper", "--out", folder.path("p.toml")});
  EXPECT_EQ(paper.exit_code, 2);
  EXPECT_NE(paper.err.find("start from goodwin or finger"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(folder.path("p.toml")));
}

TEST(GoodwinScene, RunsByNameAndReplaysToTheByte) {
  const TemporaryFolder folder;
  const auto run_to = [&](const char* name, const char* seed) {
    const auto run = run_program({"run", "goodwin", "--fast", "--duration-s", "0.5", "--seed", seed,
                                  "--overwrite", "--sink", "csv:" + folder.path(name)});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return read_file(folder.path(name));
  };
  const std::string first = run_to("a.csv", "1");
  EXPECT_GT(first.size(), 1000U);
  EXPECT_EQ(run_to("b.csv", "1"), first);
  EXPECT_NE(run_to("c.csv", "2"), first);
}

}  // namespace
}  // namespace merkel
