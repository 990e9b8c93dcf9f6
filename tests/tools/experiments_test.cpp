#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "tests/sweep.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/text_has.hpp"
#include "tests/tools/program.hpp"
#include "tools/scene/scene_presets.hpp"
#include "tools/studies/experiments/experiment_report.hpp"
#include "tools/studies/experiments/pressed_afferents.hpp"

namespace merkel {
namespace {

TEST(Experiments, HaveASourceAProtocolAndANameOfTheirOwn) {
  std::set<std::string> names;
  for (const Experiment& experiment : experiments()) {
    EXPECT_TRUE(names.insert(experiment.name).second) << experiment.name;
    EXPECT_NE(std::string(experiment.cite).find("J Neuro"), std::string::npos) << experiment.name;
    EXPECT_GT(std::string(experiment.protocol).size(), 40U) << experiment.name;
  }
  EXPECT_GE(names.size(), 5U);
}

TEST(Experiments, AFigureMatchesWithinItsRangeOnly) {
  const ExperimentFigure half{"falling / rising", 0.5, "0.5", 0.25, 0.75};
  EXPECT_TRUE(half.matches());
  EXPECT_FALSE((ExperimentFigure{"", 1.02, "0.5", 0.25, 0.75}).matches());
  EXPECT_FALSE((ExperimentFigure{"", std::nan(""), "0.5", 0.25, 0.75}).matches());
}

// An edge that slides along the finger reaches an afferent 4 mm farther on 0.1 s later.
TEST(Experiments, ASurfaceReachesFartherAfferentsLater) {
  Indenter bar = surface_for_depth(0.8, 0.5);
  bar.tip = BarTip{.widths_mm = {2.0}, .gaps_mm = {}, .length_mm = 10.0};
  const Position places[] = {{-2.0, 0.0}, {2.0, 0.0}};
  auto afferents = PressedAfferents::create(preset_scene("goodwin")->model, bar, places, 4);
  ASSERT_TRUE(afferents) << afferents.error().key << " " << afferents.error().reason;
  const auto times = afferents->run(
      [](double time_s) { return ContactInput{.depth_mm = 0.7, .x_mm = -6.0 + 40.0 * time_s}; },
      0.3);
  ASSERT_EQ(times.size(), 2U);
  const auto middle = [](const std::vector<double>& train) {
    double sum = 0.0;
    for (const double time : train) sum += time;
    return sum / static_cast<double>(train.size());
  };
  ASSERT_GT(times[0].size(), 8U);
  ASSERT_GT(times[1].size(), 8U);
  EXPECT_NEAR(middle(times[1]) - middle(times[0]), 0.1, 0.03);
}

// All statements of the abstract hold but one: half the sensitivity is not quite half the rate.
TEST(Experiments, SpheresOnHumanFingersAreOrderedByCurvatureAndForce) {
  const auto result = spheres_on_human_fingers(preset_scene("goodwin")->model, 2);
  ASSERT_TRUE(result) << result.error().reason;
  ASSERT_EQ(result->figures.size(), 2U);
  EXPECT_TRUE(result->figures[0].matches()) << result->figures[0].model;
  EXPECT_NEAR(result->figures[1].model, 0.1, 0.03);
  ASSERT_EQ(result->curves.size(), 3U);
  EXPECT_EQ(result->curves[0].x.size(), result->curves[0].model.size());
}

TEST(Experiments, AFlatFingerCannotBeScannedAndTheReportSaysSo) {
  const TemporaryFolder folder;
  const Experiment some[] = {experiments()[0], experiments()[4]};  // squares and cylinders
  ReportTables tables;
  for (const auto& [name, columns] : kExperimentTables) {
    tables.emplace(name, *CsvTable::create(folder.path(name), columns, false));
  }
  const auto report =
      report_experiments(some, preset_scene("paper")->model, 2, {.progress = {}}, tables);
  ASSERT_TRUE(report) << report.error().sentence;
  for (auto& [name, table] : tables) ASSERT_TRUE(table.close());
  EXPECT_TRUE(has(*report, "### Raised squares and bars, scanned, not fitted")) << *report;
  EXPECT_TRUE(has(*report, "Not possible with this scene: skin.radius_mm")) << *report;
  const std::string figures = read_file(folder.path("experiments.csv"));
  EXPECT_EQ(figures.find("scanned_squares"), std::string::npos) << figures;
  EXPECT_TRUE(has(figures, "\nturned_cylinders,")) << figures;
  if (!in_sweep(1, 2)) return;  // all of them take half a minute
  const auto run = run_program({"score", "paper", "--trials", "1", "--out", folder.path("s")});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("## Whole experiments, not fitted"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("Not possible with this scene: "), std::string::npos) << run.out;
  EXPECT_EQ(read_file(folder.path("s/turned_cylinders.png")).substr(1, 3), "PNG");
}

}  // namespace
}  // namespace merkel
