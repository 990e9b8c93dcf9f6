#include <cstdlib>
#include <filesystem>

#include <gtest/gtest.h>

#include "tests/text_has.hpp"
#include "tests/tools/program.hpp"

namespace merkel {
namespace {

TEST(Bundle, HoldsARunThatReplaysToTheBitWithChecksums) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder.path("me@lab"));
  const std::string session = folder.path("me@lab/s.xdf");
  ASSERT_EQ(run_program({"run", "finger", "--fast", "--probe", "replay:tests/traces/taps.csv",
                         "--seed", "7", "--sink", "xdf:" + session})
                .exit_code,
            0);
  const std::string out = folder.path("deposit");
  const ProgramRun run = run_program({"bundle", session, "--out", out, "--skip-score", "--facts",
                                      "subject_id=model-1&species=Homo sapiens"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_TRUE(has(run.err, "bit-identical in a replay")) << run.err;
  const std::string readme = read_file(out + "/README.md");
  for (const char* const name :
       {"session.xdf", "session.nwb", "spikes.csv", "scene.toml", "versions.txt"}) {
    EXPECT_TRUE(std::filesystem::exists(out + "/" + name)) << name;
    EXPECT_TRUE(has(readme, name)) << name;
  }
  EXPECT_EQ(read_file(out + "/session.xdf"), read_file(session));
  EXPECT_EQ(std::system(("cd " + out + " && sha256sum --check --quiet SHA256SUMS").c_str()), 0);
  EXPECT_EQ(run_program({"compare", out + "/spikes.csv", out + "/session.nwb"}).exit_code, 0);
  const ProgramRun again = run_program({"replay", out + "/session.xdf"});
  EXPECT_EQ(again.exit_code, 0) << again.out;
  // The scene alone, too, gives the same spikes of the same press: it is complete, with the seeds.
  EXPECT_EQ(read_file(out + "/scene.toml"), run_program({"scene", session}).out);
  const std::string spikes = folder.path("again.csv");
  ASSERT_EQ(run_program({"run", out + "/scene.toml", "--fast", "--probe",
                         "replay:" + out + "/session.xdf", "--sink", "csv:" + spikes})
                .exit_code,
            0);
  EXPECT_EQ(read_file(spikes), read_file(out + "/spikes.csv"));
  const ProgramRun twice = run_program({"bundle", session, "--out", out, "--skip-score"});
  EXPECT_EQ(twice.exit_code, 2);
  EXPECT_TRUE(has(twice.err, "exists and is not empty")) << twice.err;
}

TEST(Bundle, ASceneWithAMeasuredShapeRunsFromTheBundleAlone) {
  const TemporaryFolder folder;
  const std::string session = folder.path("s.xdf");
  const std::string out = folder.path("deposit");
  std::string heights;
  for (int row = 0; row < 8; ++row) heights += row < 4 ? "0,0,0,0,1,1,1,1\n" : "0,0,0,0,0,0,0,0\n";
  static_cast<void>(folder.file("corner.csv", heights));
  const std::string scene =
      folder.file("s.toml", "[[probe]]\ntip = \"shape\"\nshape = \"corner.csv\"\npixel_mm = 0.2\n");
  ASSERT_EQ(run_program({"run", scene, "--fast", "--duration-s", "0.3", "--sink", "xdf:" + session})
                .exit_code,
            0);
  // The text of its scene has the name of the heights alone, as that of the scene itself.
  const ProgramRun text = run_program({"scene", session});
  EXPECT_EQ(text.exit_code, 0);
  EXPECT_TRUE(has(text.err, "holds the heights of corner.csv")) << text.err;
  EXPECT_TRUE(has(text.err, "merkel bundle " + session + " --out FOLDER")) << text.err;
  EXPECT_EQ(run_program({"scene", scene}).err, "");
  ASSERT_EQ(run_program({"bundle", session, "--out", out, "--skip-score"}).exit_code, 0);
  const std::string spikes = folder.path("again.csv");
  const ProgramRun again = run_program(
      {"run", out + "/scene.toml", "--fast", "--duration-s", "0.3", "--sink", "csv:" + spikes});
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_GT(read_file(spikes).size(), std::string("time_s,neuron\n").size());
  EXPECT_EQ(read_file(spikes), read_file(out + "/spikes.csv"));
}

TEST(Bundle, ASessionWithoutASimulationIsRefused) {
  const TemporaryFolder folder;
  const std::string session = folder.path("s.xdf");
  ASSERT_EQ(run_program({"record", "sim:taps?count=1", session}).exit_code, 0);
  const ProgramRun run = run_program({"bundle", session, "--out", folder.path("out")});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_TRUE(has(run.err, "only a session of merkel run")) << run.err;
}

}  // namespace
}  // namespace merkel
