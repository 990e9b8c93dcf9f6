#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/temporary_folder.hpp"
#include "tests/tools/program.hpp"

namespace merkel {
namespace {

TEST(Compare, FindsEveryFormatEqualAndSaysWhatDiffers) {
  const TemporaryFolder folder;
  const std::string csv = folder.path("s.csv");
  std::vector<std::string> run = {
      "run", "finger", "--fast", "--probe", "replay:tests/traces/taps.csv", "--sink", "csv:" + csv};
  const std::vector<std::string> others = {
      "gdf:" + folder.path("s.gdf"), "xdf:" + folder.path("s.xdf"), "sonata:" + folder.path("s.h5"),
      "nwb:" + folder.path("s.nwb"), "phy:" + folder.path("s")};
  for (const std::string& uri : others) run.insert(run.end(), {"--sink", uri});
  const ProgramRun made = run_program(run);
  ASSERT_EQ(made.exit_code, 0) << made.err;
  for (const std::string& uri : others) {
    const std::string file = uri.substr(uri.find(':') + 1);
    const ProgramRun same = run_program({"compare", csv, file, "--within-us", "0.6", "--json"});
    EXPECT_EQ(same.exit_code, 0) << uri << same.out << same.err;
    const auto json = nlohmann::json::parse(same.out);
    EXPECT_GT(json["matched"], 50);
    EXPECT_EQ(json["only_in_a"], 0);
  }
}

TEST(Compare, MatchesWithinATolerance) {
  const TemporaryFolder folder;
  const std::string a = folder.file("a.csv", "time_s,neuron\n0.1,1\n0.2,1\n0.3,2\n");
  const std::string b =
      folder.file("b.csv", "# a note\ntime_s,neuron\n0.1000005,1\n0.2000020,1\n0.3,3\n");
  const ProgramRun near = run_program({"compare", a, b});
  EXPECT_EQ(near.exit_code, 1);
  EXPECT_EQ(near.out,
            "1 spikes of both within 1 us, rms 0.500 us, largest 0.500 us\nonly in " + a +
                ": 2\n  neuron 1 at 0.200000000 s\n  neuron 2 at 0.300000000 s\nonly in " + b +
                ": 2\n  neuron 1 at 0.200002000 s\n  neuron 3 at 0.300000000 s\ndifferent\n");
  EXPECT_EQ(run_program({"compare", a, a, "--within-us", "0"}).exit_code, 0);
  EXPECT_NE(run_program({"compare", a, b, "--within-us", "3"}).out.find("2 spikes of both"),
            std::string::npos);
}

TEST(Compare, CountsTimesFromTheStartOfTheRun) {
  const TemporaryFolder folder;
  const std::string a = folder.file("a.csv",
                                    "# time_offset_ns=5000000000\n# start_device_ns=5000000000\n"
                                    "time_s,neuron\n0.1,1\n");
  const std::string b = folder.file("b.csv",
                                    "# time_offset_ns=0\n# start_device_ns=5000000000\n"
                                    "time_s,neuron\n5.1,1\n");
  EXPECT_EQ(run_program({"compare", a, b}).exit_code, 0);
}

TEST(Compare, RefusesWhatItCannotRead) {
  const TemporaryFolder folder;
  const std::string a = folder.file("a.csv", "time_s,neuron\n0.1,1\n");
  for (const auto& [content, sentence] :
       {std::pair("time_s,neuron\n0.1,0\n", "b:2: this is no spike"),
        std::pair("hello\n", "b:1: this is no spike"), std::pair("XDF:x", "is damaged"),
        std::pair("\x89HDF\r\n\x1a\nrubbish", "HDF5 refused")}) {
    const ProgramRun run = run_program({"compare", a, folder.file("b", content)});
    EXPECT_EQ(run.exit_code, 2) << run.out;
    EXPECT_NE(run.err.find(sentence), std::string::npos) << run.err;
  }
  EXPECT_EQ(run_program({"compare", a, folder.path("none.csv")}).exit_code, 2);
  EXPECT_EQ(run_program({"compare", a}).exit_code, 2);
}

}  // namespace
}  // namespace merkel
