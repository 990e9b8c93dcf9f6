#include <algorithm>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/temporary_folder.hpp"
#include "tests/tools/program.hpp"

namespace merkel {
namespace {

TEST(Record, TheBundledTracesAreWhatTheirCommandsMake) {
  const TemporaryFolder folder;
  int traces = 0;
  for (const auto& entry : std::filesystem::directory_iterator("tests/traces")) {
    if (entry.path().extension() != ".csv") continue;
    const std::string trace = read_file(entry.path().string());
    // "# merkel record 'URI' FILE"
    const auto quote = trace.find('\'');
    ASSERT_NE(quote, std::string::npos) << entry.path();
    const std::string uri = trace.substr(quote + 1, trace.find('\'', quote + 1) - quote - 1);
    const std::string copy = folder.path(entry.path().filename().string());
    ASSERT_EQ(run_program({"record", uri, copy}).exit_code, 0) << uri;
    const auto rows = [](const std::string& text) { return text.substr(text.find('\n')); };
    EXPECT_EQ(rows(read_file(copy)), rows(trace)) << entry.path();
    ++traces;
  }
  EXPECT_GE(traces, 4);
}

TEST(Record, RoundTripIsExactAndMemoryBounded) {
  const TemporaryFolder folder;
  // 40 MB of trace.
  ASSERT_EQ(
      run_program({"record", "sim:sine?hold_s=60&rate_hz=20000&noise_um=3&x_mm=3&jitter_us=10",
                   folder.path("a.csv")})
          .exit_code,
      0);
  EXPECT_GT(std::filesystem::file_size(folder.path("a.csv")), 40'000'000U);
  const auto run = run_program({"record", "replay:" + folder.path("a.csv"), folder.path("b.csv")});
  EXPECT_EQ(run.exit_code, 0);
#ifndef MERKEL_SANITIZED
  EXPECT_LT(run.peak_memory_MiB, 30.0);
#endif
  const auto rows = [](const std::string& text) { return text.substr(text.find('\n')); };
  EXPECT_EQ(rows(read_file(folder.path("a.csv"))), rows(read_file(folder.path("b.csv"))));
}

TEST(Record, StopsAfterTheDuration) {
  const TemporaryFolder folder;
  ASSERT_EQ(
      run_program({"record", "sim:ramp", folder.path("a.csv"), "--duration-s", "0.1"}).exit_code,
      0);
  const std::string trace = read_file(folder.path("a.csv"));
  EXPECT_EQ(std::count(trace.begin(), trace.end(), '\n'),
            3 + 101);  // command, columns, validity, samples
}

TEST(Record, NamesTheFileThatItWrote) {
  const TemporaryFolder folder;
  const ProgramRun record = run_program({"record", "sim:ramp", folder.path("a-%t.csv"), "--json"});
  ASSERT_EQ(record.exit_code, 0) << record.err;
  const std::string file = nlohmann::json::parse(record.out)["file"];
  EXPECT_TRUE(std::filesystem::exists(file)) << file;
}

}  // namespace
}  // namespace merkel
