#include <algorithm>
#include <array>
#include <chrono>
#include <functional>
#include <iterator>
#include <map>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/core.h>
#include <gtest/gtest.h>

#include "tests/temporary_folder.hpp"
#include "tests/text_has.hpp"
#include "tools/studies/charts/chart.hpp"

namespace merkel {
namespace {

struct Chart {
  std::string text;
  std::vector<std::vector<std::string>> rows;  ///< of its table
  double took_us = 0.0;
};

Chart chart_of(const std::function<MakePart>& make, const std::string& table) {
  const TemporaryFolder folder;
  ReportTables tables;
  tables.emplace(table, *CsvTable::create(folder.path(table), "", false));
  std::vector<double> done;
  const auto begin = std::chrono::steady_clock::now();
  const auto text = make(
      {.folder = folder.path(""), .progress = [&](double fraction) { done.push_back(fraction); }},
      tables);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  EXPECT_FALSE(done.empty());
  EXPECT_TRUE(std::ranges::is_sorted(done));
  EXPECT_TRUE(std::ranges::all_of(done, [](double each) { return each > 0.0 && each <= 1.0; }));
  EXPECT_TRUE(tables.at(table).close());
  Chart chart{
      .text = text ? *text : text.error().sentence, .rows = {}, .took_us = 1e6 * took.count()};
  std::istringstream lines(read_file(folder.path(table)));
  for (std::string line; std::getline(lines, line);) {
    if (line.empty()) continue;  // the header
    std::istringstream fields(line);
    auto& row = chart.rows.emplace_back();
    for (std::string field; std::getline(fields, field, ',');) row.push_back(field);
  }
  return chart;
}

TEST(Charts, TheStabilityMapNamesTheLargestStepUpToWhichItsTableIsRight) {
  const Chart chart = chart_of(make_stability_chart, "stability.csv");
  // Of each method, in the four columns: whether all counts are right, by step in µs.
  std::map<std::string, std::array<std::map<double, bool>, 4>> methods;
  for (const auto& row : chart.rows) {
    const double step_us = std::stod(row[1]);
    const double current = std::stod(row[2]);
    const double gain = std::stod(row[3]);
    auto& columns = methods[row[0]];
    const bool covered[4] = {gain == 0.0 && current == 10.0, gain == 0.0 && current <= 60.0,
                             gain == 0.1, gain == 25.0};
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (covered[i]) columns[i].try_emplace(step_us, true).first->second &= row[4] == "0";
    }
  }
  EXPECT_GE(methods.size(), 4U);
  for (const auto& [method, columns] : methods) {
    std::string row = "| " + method + " |";
    for (const auto& steps : columns) {
      const auto wrong =
          std::ranges::find(steps, false, [](const auto& each) { return each.second; });
      row += wrong == steps.begin() ? " – |" : fmt::format(" {:g} µs |", std::prev(wrong)->first);
    }
    EXPECT_TRUE(has(chart.text, row + "\n")) << row << "\n" << chart.text;
  }
}

TEST(Charts, ADeeperTouchReachesMoreAfferents) {
  const Chart chart = chart_of(make_touch_chart, "touch.csv");
  ASSERT_EQ(chart.rows.size(), 21U);
  std::map<std::string, double> reached_before;
  double cost_us = 0.0;
  std::string on_the_smallest;
  for (const auto& row : chart.rows) {
    const double depth_mm = std::stod(row[2]);
    const double area_mm2 = std::stod(row[3]);
    // A sphere of 5 mm on flat skin.
    EXPECT_NEAR(area_mm2, std::numbers::pi * 5.0 * depth_mm, 1e-5 * area_mm2) << depth_mm;
    const double reached = std::stod(row[4]);
    EXPECT_GE(reached, reached_before[row[0]]) << row[0] << " " << depth_mm;
    EXPECT_LE(reached, std::stod(row[1]));
    EXPECT_EQ(reached > 0.0, depth_mm > 0.0);
    if (depth_mm == 0.0) {
      EXPECT_EQ(row[5], "0");
    }
    if (depth_mm == 3.0) {
      EXPECT_GT(std::stod(row[5]), 15.0);
    }
    EXPECT_GT(std::stod(row[6]), 0.0);
    cost_us += std::stod(row[6]);
    if (row[0] == "450") on_the_smallest += row[4] + " ";
    reached_before[row[0]] = reached;
    EXPECT_TRUE(has(chart.text, fmt::format("| {} | {} | {:g} | {:.1f} | {} | {} | ", row[0],
                                            row[1], depth_mm, area_mm2, row[4], row[5])))
        << depth_mm << "\n"
        << chart.text;
  }
  // Each tick is run more than once.
  EXPECT_LT(cost_us, chart.took_us);
  EXPECT_EQ(on_the_smallest, "0 2 2 6 12 16 20 ");
}

TEST(Charts, TheContactStageErrsByWhatItCulls) {
  const Chart chart = chart_of(make_contact_chart, "contact_stage.csv");
  ASSERT_EQ(chart.rows.size(), 16U);
  std::map<std::string, double> reached_before;
  double cost_us = 0.0;
  for (const auto& row : chart.rows) {
    const double tolerance = std::stod(row[1]);
    const double error = std::stod(row[3]);
    const double reached = std::stod(row[4]);
    SCOPED_TRACE(row[0] + " " + row[1]);
    const bool in_float = has(row[0], "float");
    if (has(row[0], "culled")) {
      // An afferent has some twenty receptors of at most 22.5 µA/cm².
      EXPECT_GT(error, 0.0);
      EXPECT_LT(error, 450.0 * tolerance + 1e-5);
      const auto [before, first] = reached_before.try_emplace(row[0], reached);
      EXPECT_LE(reached, before->second);
      before->second = reached;
    } else {
      EXPECT_LT(error, in_float ? 1e-5 : 1e-8);
      EXPECT_EQ(error > 1e-9, in_float || tolerance == 0.01);
      EXPECT_EQ(reached, 20.0);
    }
    EXPECT_GT(std::stod(row[2]), 0.0);
    cost_us += std::stod(row[2]);
  }
  EXPECT_LT(cost_us, chart.took_us);
  EXPECT_EQ(reached_before.size(), 2U);
  for (const auto& [method, reached] : reached_before) EXPECT_LT(reached, 10.0) << method;
  EXPECT_TRUE(has(chart.text, "| kernel culled at 1e-03 | ")) << chart.text;
}

}  // namespace
}  // namespace merkel
