#include "drivers/uri.hpp"

#include <gtest/gtest.h>

namespace merkel {
namespace {

TEST(Uri, HasSchemePathAndOptions) {
  const auto uri = Uri::parse("serial:/dev/ttyUSB0?protocol=mark10&baud=115200");
  ASSERT_TRUE(uri);
  EXPECT_EQ(uri->scheme, "serial");
  EXPECT_EQ(uri->path, "/dev/ttyUSB0");
  EXPECT_EQ(uri->options.at("protocol"), "mark10");
  EXPECT_EQ(uri->options.at("baud"), "115200");
}

TEST(Uri, PathsAreTakenAsGiven) {
  EXPECT_EQ(Uri::parse("replay:/a/../b c?d.csv?chunk=1")->path, "/a/../b c?d.csv");
  EXPECT_EQ(Uri::parse("zmq:tcp://127.0.0.1:5557")->path, "tcp://127.0.0.1:5557");
}

TEST(Uri, RefusesMalformedText) {
  for (const char* text : {"", "plain", ":path", "a:b?c", "a:b?=1", "a:b?c=1&c=2"}) {
    EXPECT_FALSE(Uri::parse(text)) << text;
  }
}

TEST(UriOptions, ReadTypedValuesWithinTheirLimits) {
  const auto uri = Uri::parse("x:y?a=1.5&b=7&c=red");
  UriOptions options(*uri);
  EXPECT_EQ(options.number("a", 0.0, 0.0, 2.0), 1.5);
  EXPECT_EQ(options.whole("b", 0, 0, 10), 7);
  EXPECT_EQ(options.word("c", "blue", "red|blue"), "red");
  EXPECT_EQ(options.number("d", 4.0, 0.0, 9.0), 4.0);
  EXPECT_TRUE(options.finish());
}

TEST(UriOptions, KeepTheFirstFault) {
  const auto uri = Uri::parse("x:y?a=9&c=green");
  UriOptions options(*uri);
  options.number("a", 0.0, 0.0, 2.0);
  options.word("c", "blue", "red|blue");
  EXPECT_EQ(options.finish().error().sentence,
            "\"x:y?a=9&c=green\": the option a must be a number from 0 to 2, but is \"9\"");
}

}  // namespace
}  // namespace merkel
