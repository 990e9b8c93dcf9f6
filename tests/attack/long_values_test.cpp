// Values of a megabyte, wherever a message echoes them.
#include <string>

#include <gtest/gtest.h>

#include "core/parameters/nearest_name.hpp"
#include "drivers/printable_text.hpp"
#include "drivers/probes/device_notices.hpp"

namespace merkel {
namespace {

const std::string kLong(1'000'000, 'x');

TEST(LongValues, AreCutAndCauseAndAdviceStay) {
  const std::string message =
      shortened("the probe replay:" + kLong + ".csv cannot be read: give another name");
  EXPECT_LT(message.size(), 400U);
  EXPECT_TRUE(message.starts_with("the probe replay:xxx")) << message;
  EXPECT_TRUE(message.ends_with("xxx.csv cannot be read: give another name")) << message;
  std::string words;
  for (int k = 0; k < 100'000; ++k) words += "word ";
  const std::string cut = shortened("\"" + words + "\" is no preset: see merkel scene --keys");
  EXPECT_LT(cut.size(), 4'000U);
  EXPECT_TRUE(cut.starts_with("\"word word"));
  EXPECT_TRUE(cut.ends_with("is no preset: see merkel scene --keys"));
}

TEST(LongValues, NothingShortIsCut) {
  for (const std::string& text : {std::string(), std::string(" "), std::string("a  b\n\tc "),
                                  "file " + std::string(299, 'x') + ": no", kLong.substr(0, 300)}) {
    EXPECT_EQ(shortened(text), text);
  }
}

TEST(LongValues, ANoticeOfADeviceKeepsItsAdvice) {
  DeviceNotices notices;
  notices.add("the device " + kLong + "\x1b[2J is lost: plug it in", std::chrono::seconds{1});
  const auto taken = notices.take();
  ASSERT_EQ(taken.size(), 1U);
  EXPECT_LT(taken[0].size(), 500U);
  EXPECT_TRUE(taken[0].ends_with("is lost: plug it in")) << taken[0];
  EXPECT_EQ(taken[0].find('\x1b'), std::string::npos);
}

TEST(LongValues, HaveNoNearNameAndItsPrefixHas) {
  const std::vector<std::string> known = {"radius_mm", "delay_ms"};
  EXPECT_EQ(nearest_name(kLong, known), "");
  EXPECT_EQ(nearest_name("delay", known), "delay_ms");
}

}  // namespace
}  // namespace merkel
