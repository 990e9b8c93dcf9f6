// The line that run, record and calibrate show at a terminal, and calibrate's dialogue.
#include "tools/run/terminal_line.hpp"

#include <algorithm>
#include <chrono>
#include <regex>
#include <sstream>
#include <thread>

#include <gtest/gtest.h>

#include "tests/drivers/simulation/line_printer.hpp"
#include "tests/tools/terminal.hpp"
#include "tools/run/long_work.hpp"
#include "tools/run/status_line.hpp"

namespace merkel {
namespace {

/// Columns that a text takes on a terminal.
std::size_t width(const std::string& text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U;
  }));
}

/// Every text that stood in the last line: each begins with a return and an erase.
std::vector<std::string> lines_shown(const std::string& screen) {
  std::vector<std::string> lines;
  const std::string erase = "\r\033[K";
  for (auto at = screen.find(erase); at != std::string::npos; at = screen.find(erase, at)) {
    at += erase.size();
    const std::string line = screen.substr(at, screen.find_first_of("\r\n", at) - at);
    // Sentences are erased by nothing: they scroll.
    const bool sentence =
        line.starts_with("merkel:") || line.find(" written ") != std::string::npos;
    if (!line.empty() && !sentence) lines.push_back(line);
  }
  return lines;
}

TEST(TerminalLine, FitsEveryWidth) {
  const std::vector<std::string> fields = {"12 s",
                                           "0.321 N 1.02 mm [####      ]",
                                           "",
                                           "1.5 µs",
                                           "80 000 spikes/s",
                                           "a field that is far too long …"};
  for (std::size_t columns = 1; columns <= 120; ++columns) {
    const std::string line = fit_line(fields, columns);
    EXPECT_LE(width(line), columns);
    EXPECT_FALSE(line.empty());
    // Whole fields only, but for the first.
    if (columns >= 4) {
      EXPECT_TRUE(line.starts_with("12 s")) << line;
    }
    // No character is cut in two.
    EXPECT_NE(static_cast<unsigned char>(line.back()) & 0xC0U, 0xC0U) << line;
  }
  EXPECT_EQ(fit_line(fields, 200).find("  "), 4U);  // an empty field leaves no gap
  EXPECT_EQ(fit_line({"µµµ"}, 2), "µµ");
}

TEST(StatusLine, ShowsTheReadingAndItsStateWithin40Columns) {
  RunProgress progress;
  progress.wall = std::chrono::seconds{100};
  progress.probes = {{.depth_mm = 14.99,
                      .force_mN = 49'999.0,
                      .channels = ProbeSample::kDepth | ProbeSample::kForce,
                      .state = TickRecord::State::kReleased}};
  progress.counters.spikes = 400'000;
  progress.counters.samples = 1'000'000;
  progress.counters.samples_late = 120;
  progress.counters.probe_count = 1;
  StatusLine status;
  const auto fields = status.fields(progress);
  for (const std::size_t columns : {20U, 40U, 60U, 79U}) {
    EXPECT_LE(width(fit_line(fields, columns)), columns);
  }
  const std::string narrow = fit_line(fields, 40);
  EXPECT_NE(narrow.find("49.999 N"), std::string::npos) << narrow;
  const std::string usual = fit_line(fields, 79);
  EXPECT_NE(usual.find("released"), std::string::npos) << usual;
  EXPECT_NE(usual.find("spikes/s"), std::string::npos) << usual;
  EXPECT_NE(usual.find("late"), std::string::npos) << usual;
}

TEST(Terminal, RunAndRecordShowOneLineThatFits) {
  for (const unsigned short columns : {std::uint16_t{80}, std::uint16_t{34}}) {
    const TemporaryFolder folder;
    const std::string press = "sim:ramp?wait_s=0&hold_s=600&live=1&force_N=0.3&depth_mm=1";
    TerminalProgram run({"run", "--probe", press, "--duration-s", "2"}, columns);
    TerminalProgram record({"record", press, folder.path("t.csv"), "--duration-s", "2"}, columns);
    for (TerminalProgram* const program : {&run, &record}) {
      const ProgramRun ended = program->finish();
      EXPECT_LE(ended.exit_code, 1) << ended.err;  // a busy machine may skip ticks: a loss
      const auto lines = lines_shown(ended.err);
      EXPECT_GE(lines.size(), 2U) << ended.err;
      for (const std::string& line : lines) EXPECT_LT(width(line), columns) << line;
      EXPECT_TRUE(std::regex_search(lines.back(), std::regex(R"(0\.\d+ N \d\.\d+ mm \[#)")))
          << lines.back();
    }
  }
}

TEST(Terminal, CalibrateWaitsForEachLoadAndShowsReadingsAndResiduals) {
  const TemporaryFolder folder;
  LinePrinter gauge("0.100");
  TerminalProgram program({"calibrate", "serial:" + gauge.name() + "?protocol=csv&columns=force_N",
                           folder.path("c.toml"), "--points", "0,1,2", "--seconds", "0.3"},
                          60);
  ASSERT_TRUE(program.wait_for("apply 0 N and press Enter"));
  program.type("\n");
  ASSERT_TRUE(program.wait_for("apply 1 N and press Enter"));
  gauge.print("0.590");
  program.type("\n");
  ASSERT_TRUE(program.wait_for("apply 2 N and press Enter"));
  gauge.print("1.100");
  program.type("\n");
  const ProgramRun ended = program.finish();
  EXPECT_EQ(ended.exit_code, 0) << ended.err;
  const auto lines = lines_shown(ended.err);
  EXPECT_GE(lines.size(), 3U) << ended.err;
  for (const std::string& line : lines) EXPECT_LT(width(line), 60U) << line;
  // The least-squares line through (0.1, 0), (0.59, 1), (1.1, 2).
  EXPECT_NE(ended.out.find("residual +0.0068"), std::string::npos) << ended.out;
  EXPECT_NE(ended.out.find("1 N: the fit gives 0.9867, residual -0.013"), std::string::npos)
      << ended.out;
  EXPECT_NE(read_file(folder.path("c.toml")).find("gain = 1.9997"), std::string::npos)
      << read_file(folder.path("c.toml"));
}

TEST(Terminal, CalibrateRefusesAPointThatMoves) {
  const TemporaryFolder folder;
  LinePrinter gauge("0.1");
  TerminalProgram program({"calibrate", "serial:" + gauge.name() + "?protocol=csv&columns=force_N",
                           folder.path("c.toml"), "--points", "0,1", "--seconds", "0.3"},
                          80);
  ASSERT_TRUE(program.wait_for("apply 0 N"));
  program.type("\n");
  ASSERT_TRUE(program.wait_for("apply 1 N"));
  gauge.drift(1.0, 0.002);  // 0.12 N in 0.3 s
  program.type("\n");
  const ProgramRun ended = program.finish();
  EXPECT_EQ(ended.exit_code, 1);
  EXPECT_NE(ended.err.find("drifted"), std::string::npos) << ended.err;
  EXPECT_NE(ended.err.find("keep the load constant"), std::string::npos) << ended.err;
  EXPECT_FALSE(std::filesystem::exists(folder.path("c.toml")));
}

TEST(LongWork, IsReportedOnceWhileItLasts) {
  testing::internal::CaptureStderr();
  {
    const LongWork work("still at work", std::chrono::milliseconds{10});
    std::this_thread::sleep_for(std::chrono::milliseconds{500});
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "merkel: still at work\n");
  testing::internal::CaptureStderr();
  { const LongWork work("still at work", std::chrono::hours{1}); }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(LongRun, IsReportedAtDoublingTimesWithWhatIsLeft) {
  using std::chrono::seconds;
  LongRun run;
  const auto said = [&](seconds wall, seconds simulated, seconds known) {
    testing::internal::CaptureStderr();
    run.report({.wall = wall, .simulated = simulated, .known = known});
    return testing::internal::GetCapturedStderr();
  };
  EXPECT_EQ(said(seconds{4}, seconds{100}, seconds{100}), "");
  EXPECT_EQ(
      said(seconds{5}, seconds{200}, seconds{1000}),
      "merkel: simulated 200 s of at least 1000 s in 5 s: about 20 s more; an interrupt (Ctrl-C) "
      "ends the run and keeps its output\n");
  EXPECT_EQ(said(seconds{9}, seconds{300}, seconds{1000}), "");
  EXPECT_EQ(
      said(seconds{10}, seconds{400}, seconds{404}),
      "merkel: simulated 400 s in 10 s; an interrupt (Ctrl-C) ends the run and keeps its output\n");
}

}  // namespace
}  // namespace merkel
