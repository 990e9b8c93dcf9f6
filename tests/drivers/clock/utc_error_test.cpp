// The answers are those of chrony 4.3 and linuxptp 3.1.1 (Debian 12).
#include "drivers/clock/utc_error.hpp"

#include <string>

#include <gtest/gtest.h>

namespace merkel {
namespace {

const std::string kTracking =
    "7F000001,127.0.0.1,3,1795419781.492493884,-0.000001253,-0.000005198,0.000009488,-0.712,-0.027,"
    "25.363,0.000005612,0.000009147,0.3,Normal\n";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

TEST(UtcError, IsChronysBound) {
  const auto error = chrony_error(kTracking);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->source, "chrony");
  EXPECT_EQ(error->largest.count(), 1253 + 5612 / 2 + 9147);
}

TEST(UtcError, IsUnknownWhereChronyFollowsNoSource) {
  EXPECT_FALSE(
      chrony_error("7F7F0101,,8,1795419752.719355469,0.000000000,0.000000000,0.000000000,0.000,"
                   "0.000,0.000,0.000000000,0.000000000,0.0,Normal\n"));
  EXPECT_FALSE(
      chrony_error("00000000,,0,0.000000000,0.000000000,0.000000000,0.000000000,0.000,0.000,0.000,"
                   "1.000000000,1.000000000,0.0,Not synchronised\n"));
}

TEST(UtcError, OtherTextsOfChronyAreRefused) {
  EXPECT_FALSE(chrony_error(""));
  EXPECT_FALSE(chrony_error("506 Cannot talk to daemon\n"));
  EXPECT_FALSE(chrony_error("System time     : 0.000000952 seconds fast of NTP time\n"));
  EXPECT_FALSE(chrony_error(replaced(kTracking, ",Normal", "")));
  EXPECT_FALSE(chrony_error(replaced(kTracking, ",Normal", ",Normal,1")));
  EXPECT_FALSE(chrony_error(replaced(kTracking, "0.000009147", "soon")));
  EXPECT_FALSE(chrony_error(replaced(kTracking, "0.000009147", "nan")));
  EXPECT_FALSE(chrony_error(replaced(kTracking, "0.000009147", "1e300")));
  EXPECT_FALSE(chrony_error(std::string(100'000, ',')));
}

const std::string kPtp =
    "sending: GET CURRENT_DATA_SET\n"
    "sending: GET TIME_STATUS_NP\n"
    "\tc27351.fffe.1de022-0 seq 0 RESPONSE MANAGEMENT CURRENT_DATA_SET \n"
    "\t\tstepsRemoved     1\n"
    "\t\toffsetFromMaster -890.0\n"
    "\t\tmeanPathDelay    2494.0\n"
    "\tc27351.fffe.1de022-0 seq 1 RESPONSE MANAGEMENT TIME_STATUS_NP \n"
    "\t\tmaster_offset              -890\n"
    "\t\tingress_time               1795419979237625455\n"
    "\t\tcumulativeScaledRateOffset +0.000000000\n"
    "\t\tscaledLastGmPhaseChange    0\n"
    "\t\tgmTimeBaseIndicator        0\n"
    "\t\tlastGmPhaseChange          0x0000'0000000000000000.0000\n"
    "\t\tgmPresent                  true\n"
    "\t\tgmIdentity                 5a2a51.fffe.6dd0e1\n";

TEST(UtcError, OfPtpIsItsOffsetAndDelay) {
  const auto error = ptp_error(kPtp);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->source, "ptp");
  EXPECT_EQ(error->largest.count(), 890 + 2494);
}

TEST(UtcError, IsUnknownWithoutAGrandmasterOrAnAnswer) {
  EXPECT_FALSE(ptp_error(replaced(kPtp, "true", "false")));
  EXPECT_FALSE(ptp_error("sending: GET CURRENT_DATA_SET\nsending: GET TIME_STATUS_NP\n"));
  EXPECT_FALSE(ptp_error(replaced(kPtp, "2494.0", "")));
  EXPECT_FALSE(ptp_error(replaced(kPtp, "-890.0", "9e999")));
  EXPECT_FALSE(ptp_error(kPtp.substr(0, kPtp.find("gmPresent") + 12)));
}

}  // namespace
}  // namespace merkel
