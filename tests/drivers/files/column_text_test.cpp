#include "drivers/files/column_text.hpp"

#include <gtest/gtest.h>

#include "core/records/columns.hpp"

namespace merkel {
namespace {

TEST(ColumnText, HasTimesInSecondsWordsAndShortNumbers) {
  EXPECT_EQ(csv_header(kCommandColumns),
            "time_s,electrode,kind,amplitude_uA,frequency_Hz,heartbeat,stop");
  std::string row = "x,";
  append_csv(row, kCommandColumns,
             StimulationCommand{.time = std::chrono::nanoseconds{1'500'000'001},
                                .amplitude_uA = 0.1,
                                .frequency_Hz = 80.0,
                                .heartbeat = 7,
                                .electrode = 2,
                                .stop = StimulationCommand::Stop::kGap});
  EXPECT_EQ(row, "x,1.500000001,2,update,0.1,80,7,gap");
}

TEST(ColumnText, AFieldThatHoldsASeparatorIsQuoted) {
  const auto field = [](std::string_view text) {
    std::string row = "1,";
    append_field(row, text);
    return row;
  };
  EXPECT_EQ(field("trial 1"), "1,trial 1");
  EXPECT_EQ(field("trial 1, left"), "1,\"trial 1, left\"");
  EXPECT_EQ(field("a \"b\""), "1,\"a \"\"b\"\"\"");
  EXPECT_EQ(field("a\nb"), "1,\"a\nb\"");
}

}  // namespace
}  // namespace merkel
