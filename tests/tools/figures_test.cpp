#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/core.h>
#include <gtest/gtest.h>

#include "tests/temporary_folder.hpp"
#include "tests/text_has.hpp"
#include "tests/tools/program.hpp"
#include "tools/studies/figures/figure.hpp"

namespace merkel {
namespace {

TEST(Figures, AreTablesPicturesAndAReport) {
  const TemporaryFolder folder;
  const auto run =
      run_program({"figures", "--out", folder.path("f"), "--seeds", "2", "--scan-seeds", "1"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  for (const char* name : {"fig4_grating", "fig5_depth", "fig6_centre_press", "fig7_draws",
                           "fig8_positions", "contact_laws"}) {
    EXPECT_GT(read_file(folder.path(std::string("f/") + name + ".csv")).size(), 100U) << name;
    EXPECT_EQ(read_file(folder.path(std::string("f/") + name + ".png")).substr(1, 3), "PNG");
  }
  EXPECT_GT(read_file(folder.path("f/curved_bars.csv")).size(), 100U);
  const std::string report = read_file(folder.path("f/report.md"));
  EXPECT_EQ(report, run.out);
  // The published peaks of Fig. 5 and its verdicts; those of Figs 6 to 8 need more draws.
  // The model and the boundary elements bend the same finger.
  std::istringstream bars(report.substr(report.find("| energy, edge |")));
  std::string line;
  int bar_rows = 0;
  for (std::getline(bars, line), std::getline(bars, line); std::getline(bars, line);) {
    double width = 0.0, depth = 0.0, force = 0.0;
    if (std::sscanf(line.c_str(), "| %lf | %lf | %lf %%", &width, &depth, &force) != 3) break;
    EXPECT_LT(std::fabs(force), 3.0) << line;
    ++bar_rows;
  }
  EXPECT_EQ(bar_rows, 6);
  for (const char* row :
       {"| 5 | 1 | 1.42 | 0.00 | single peak |", "| 5 | 2 | 2.05 |", "| 5 | 3 | 2.58 |",
        "| 5 | 4 | 3.05 |", "| 5 | 5 | 3.48 |", "| 2 | 1 | 4.85 |",
        "Amplitude grows with depth: **reproduced**", "annular from 2 mm: **reproduced**",
        "Edge rates far above the inside: **reproduced**", "where they differ): **reproduced**",
        "| width (mm) | depth (mm) | force | energy, middle | energy, edge |"}) {
    EXPECT_NE(report.find(row), std::string::npos) << row;
  }
}

/// A part of the report; its tables are left in a folder.
std::string part_in(const TemporaryFolder& folder, const std::vector<std::string>& names,
                    const std::function<MakePart>& make) {
  ReportTables tables;
  for (const std::string& name : names) {
    tables.emplace(name, *CsvTable::create(folder.path(name), "", false));
  }
  const auto text = make({.folder = folder.path("")}, tables);
  for (auto& [name, table] : tables) EXPECT_TRUE(table.close());
  return text ? *text : text.error().sentence;
}

TEST(Figures, TheEnergyDensityFallsFromItsPeakOn) {
  const TemporaryFolder folder;
  const std::string report = part_in(folder, {"fig5_depth.csv"}, make_depth_profiles);
  for (const char* const part :
       {"| 5 | 2 | 2.05 | 2.38 | annular |", "**not reproduced, it rises**",
        "**not reproduced, it falls from its peak on**"}) {
    EXPECT_TRUE(has(report, part)) << part << "\n" << report;
  }
}

TEST(Figures, TheCentrePressCountsTheDrawsOfItsTable) {
  const TemporaryFolder folder;
  const std::string report = part_in(folder, {"fig6_centre_press.csv", "fig7_draws.csv"},
                                     [](const ReportFolder& to, ReportTables& tables) {
                                       return make_centre_press(to, tables, 12);
                                     });
  struct Draws {
    int alone = 0, above = 0, more = 0;
  };
  std::map<std::string, Draws> draws;
  std::istringstream rows(read_file(folder.path("fig7_draws.csv")));
  std::vector<double> receptors, rates;  // of a draw's 20 afferents
  for (std::string line; std::getline(rows, line);) {
    char set[16];
    double rate = 0.0, count = 0.0;
    if (std::sscanf(line.c_str(), "%15[^,],%*f,%*f,%lf,%*f,%lf", set, &count, &rate) != 3) continue;
    receptors.push_back(count);
    rates.push_back(rate);
    if (rates.size() < 20) continue;
    Draws& of_set = draws[set];
    const auto most = std::max_element(rates.begin(), rates.end());
    of_set.alone += rates[12] == *most && rates[12] > rates[7];
    of_set.more += receptors[17] > receptors[7];
    of_set.above += receptors[17] > receptors[7] && rates[17] > rates[7];
    receptors.clear();
    rates.clear();
  }
  EXPECT_EQ(draws.size(), 2U);
  for (const auto& [set, counts] : draws) {
    EXPECT_GT(counts.more, 0) << set;
    const std::string row = report.substr(report.find("| " + set + " |"));
    EXPECT_TRUE(
        has(row.substr(0, row.find('\n')),
            fmt::format("| {} of 12 | {} of {} |", counts.alone, counts.above, counts.more)))
        << row;
  }
}

TEST(Figures, DoNotReplaceFilesUnasked) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder.path("f"));
  static_cast<void>(folder.file("f/report.md", "mine"));
  const auto run = run_program({"figures", "--out", folder.path("f")});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_NE(run.err.find("--overwrite"), std::string::npos);
}

TEST(Plots, AreTitledByNamesWithoutFolderAndExtension) {
  const TemporaryFolder folder;
  for (const char* const name : {"left", "right"}) {
    std::filesystem::create_directory(folder.path(name));
  }
  std::vector<std::string> arguments = {"plot"};
  for (const char* const name : {"left/press.csv", "right/press.csv", "right/taps.csv"}) {
    arguments.push_back(folder.file(name, "time_s,neuron\n0.1,1\n0.2,1\n"));
  }
  const std::string picture = folder.path("p.svg");
  arguments.insert(arguments.end(), {"--out", picture});
  const auto run = run_program(arguments);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  // Of each text, a picture has a comment.
  const std::string svg = read_file(picture);
  for (const char* const title : {"left/press", "right/press", "taps"}) {
    EXPECT_NE(svg.find("<!-- " + std::string(title) + " -->"), std::string::npos) << title;
  }
}

TEST(Plots, DrawATraceAndRefuseOtherFiles) {
  const TemporaryFolder folder;
  const auto run = run_program({"plot", "taps", "--out", folder.path("p.svg")});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_TRUE(has(read_file(folder.path("p.svg")), "<!-- depth (mm) -->"));
  const std::string other = folder.file("notes.csv", "Monday\n");
  const auto refused = run_program({"plot", other, "--out", folder.path("q.svg")});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_TRUE(has(refused.err, other + " cannot be read as a session, as spikes or as a trace"));
}

TEST(Plots, DrawThePressOfASessionWithoutASimulation) {
  const TemporaryFolder folder;
  const std::string session = folder.path("s.xdf");
  ASSERT_EQ(run_program({"record", "sim:ramp?force_N=0.5", session}).exit_code, 0);
  const auto run = run_program({"plot", session, "--out", folder.path("p.svg")});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(read_file(folder.path("p.svg")).find("<!-- force (N) -->"), std::string::npos);
}

TEST(Plots, MarkThePressOfASlidingSurfaceWhereItTouchesTheSkin) {
  const TemporaryFolder folder;
  const std::string session = folder.path("s.xdf");
  ASSERT_EQ(run_program({"run", "braille_line", "--fast", "--duration-s", "0.3", "--sink",
                         "xdf:" + session})
                .exit_code,
            0);
  const auto run = run_program({"plot", session, "--out", folder.path("p.svg")});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  // The text has gone 15 mm across when it is pressed first; the skin begins at 0.
  const std::string svg = read_file(folder.path("p.svg"));
  EXPECT_NE(svg.find("<!-- hardest press -->"), std::string::npos);
  EXPECT_EQ(svg.find("<!-- −"), std::string::npos);
}

}  // namespace
}  // namespace merkel
