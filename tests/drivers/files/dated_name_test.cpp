#include "drivers/files/dated_name.hpp"

#include <gtest/gtest.h>

#include "drivers/files/output_file.hpp"
#include "tests/temporary_folder.hpp"

namespace merkel {
namespace {

using std::chrono::seconds;
using std::chrono::system_clock;

const system_clock::time_point kTime{seconds{1'769'860'800}};  // 2026-01-31 12:00:00 UTC

TEST(DatedName, PutsTheTimeIntoTheName) {
  EXPECT_EQ(dated_name("a/session-%t.xdf", kTime), "a/session-20260131T120000.xdf");
  EXPECT_EQ(dated_name("session.xdf", kTime), "session.xdf");
}

TEST(DatedName, FindsWhatRunsHaveLeftUnfinishedAndNothingElse) {
  const TemporaryFolder folder;
  for (const char* const name :
       {"s-20260131T120000.xdf.part", "s-20250131T120000.xdf.part", "s-20260131T120000.xdf",
        "s-yesterday.xdf.part", "s-.xdf.part", "t-20260131T120000.xdf.part", "s.xdf.part"}) {
    static_cast<void>(folder.file(name, "x"));
  }
  EXPECT_EQ(unfinished_names(folder.path("s-%t.xdf")),
            (std::vector<std::string>{folder.path("s-20250131T120000.xdf"),
                                      folder.path("s-20260131T120000.xdf")}));
  EXPECT_TRUE(unfinished_names(folder.path("s.xdf")).empty());
  EXPECT_TRUE(unfinished_names("/no/such/folder/%t.xdf").empty());
}

TEST(RecoverFile, GivesTheFileItsNameAndNeverReplacesOne) {
  const TemporaryFolder folder;
  static_cast<void>(folder.file("a.csv.part", "rows"));
  EXPECT_EQ(recover_file(folder.path("a.csv"), {}), folder.path("a.csv"));
  EXPECT_EQ(read_file(folder.path("a.csv")), "rows");
  static_cast<void>(folder.file("a.csv.part", "more rows"));
  const std::string kept = recover_file(folder.path("a.csv"), {});
  EXPECT_EQ(read_file(kept), "more rows");
  EXPECT_EQ(read_file(folder.path("a.csv")), "rows");
  EXPECT_EQ(recover_file(folder.path("a.csv"), {}), "");
}

TEST(RecoverFile, LeavesAFileAloneThatIsStillWritten) {
  const TemporaryFolder folder;
  auto file = OutputFile::create(folder.path("a.csv"), false);
  ASSERT_TRUE(file && file->write("rows") && file->flush());
  EXPECT_EQ(recover_file(folder.path("a.csv"), {}), "");
  EXPECT_TRUE(file->close());
  EXPECT_EQ(read_file(folder.path("a.csv")), "rows");
}

TEST(RecoveredName, KeepsTheEndOfTheName) {
  EXPECT_EQ(recovered_name("d.ir/s.xdf", kTime), "d.ir/s.recovered-20260131T120000.xdf");
  EXPECT_EQ(recovered_name("d.ir/s", kTime, 2), "d.ir/s.recovered-20260131T120000-2");
}

}  // namespace
}  // namespace merkel
