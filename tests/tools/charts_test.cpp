#include <algorithm>
#include <array>
#include <cstdio>
#include <iterator>
#include <map>
#include <sstream>
#include <string>

#include <fmt/core.h>
#include <gtest/gtest.h>

#include "tests/temporary_folder.hpp"
#include "tests/text_has.hpp"
#include "tools/studies/charts/chart.hpp"

namespace merkel {
namespace {

TEST(Charts, TheStabilityMapNamesTheLargestStepUpToWhichItsTableIsRight) {
  const TemporaryFolder folder;
  const std::string file = folder.path("stability.csv");
  ReportTables tables;
  tables.emplace("stability.csv", *CsvTable::create(file, "", false));
  const auto report = make_stability_chart({.folder = folder.path("")}, tables);
  ASSERT_TRUE(report) << report.error().sentence;
  ASSERT_TRUE(tables.at("stability.csv").close());

  // Of each method, in the four columns: whether all counts are right, by step in µs.
  std::map<std::string, std::array<std::map<double, bool>, 4>> methods;
  std::istringstream rows(read_file(file));
  for (std::string line; std::getline(rows, line);) {
    char method[32];
    double step_us = 0.0, current = 0.0, gain = 0.0;
    int outcome = 0;
    if (std::sscanf(line.c_str(), "%31[^,],%lf,%lf,%lf,%d", method, &step_us, &current, &gain,
                    &outcome) != 5) {
      continue;
    }
    auto& columns = methods[method];
    const bool covered[4] = {gain == 0.0 && current == 10.0, gain == 0.0 && current <= 60.0,
                             gain == 0.1, gain == 25.0};
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (covered[i]) columns[i].try_emplace(step_us, true).first->second &= outcome == 0;
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
    EXPECT_TRUE(has(*report, row + "\n")) << row << "\n" << *report;
  }
}

}  // namespace
}  // namespace merkel
