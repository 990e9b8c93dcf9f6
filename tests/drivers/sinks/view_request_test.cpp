#include "drivers/sinks/view/view_request.hpp"

#include <optional>

#include <gtest/gtest.h>

#include "core/math/random.hpp"
#include "drivers/sinks/view/view_access.hpp"

namespace merkel {
namespace {

using RequestKind = ViewRequest::Kind;

TEST(ViewAccess, PagesOfOtherSitesAndOfUnknownOriginAreKeptOut) {
  const std::string host = "127.0.0.1:8080";
  EXPECT_TRUE(may_view(host, std::nullopt, true));  // a program: no browser leaves it out
  EXPECT_TRUE(may_view(host, "http://127.0.0.1:8080", true));
  for (const char* const origin : {"", "null", "http://evil.example", "https://127.0.0.1:8080"}) {
    EXPECT_FALSE(may_view(host, origin, true)) << origin;
  }
  EXPECT_FALSE(may_view("evil.example", std::nullopt, true));
}

TEST(ViewRequest, ReadsEveryRequest) {
  const auto watch = ViewRequest::parse("watch 3 17 4250");
  ASSERT_TRUE(watch);
  EXPECT_EQ(watch->kind, RequestKind::kWatch);
  EXPECT_EQ(watch->neurons, (std::vector<std::uint32_t>{3, 17, 4250}));
  EXPECT_TRUE(ViewRequest::parse("watch")->neurons.empty());
  EXPECT_EQ(ViewRequest::parse("tare 2")->probe, 2U);
  EXPECT_EQ(ViewRequest::parse("tare all")->probe, ViewRequest::kAllProbes);
  EXPECT_EQ(ViewRequest::parse("mark left index, try 2")->label, "left index, try 2");
  EXPECT_EQ(ViewRequest::parse("record start")->kind, RequestKind::kRecordStart);
  EXPECT_EQ(ViewRequest::parse("record stop")->kind, RequestKind::kRecordStop);
  EXPECT_EQ(ViewRequest::parse("seek 12.5")->time_s, 12.5);
  EXPECT_EQ(ViewRequest::parse("pause")->kind, RequestKind::kPause);
  EXPECT_EQ(ViewRequest::parse("play")->kind, RequestKind::kPlay);
}

TEST(ViewRequest, OnlyWhatChangesARunOrItsRecordingSteers) {
  for (const char* const text : {"tare 0", "mark x", "record start", "record stop"}) {
    EXPECT_TRUE(ViewRequest::parse(text)->steers()) << text;
  }
  for (const char* const text : {"watch 1", "seek 1", "pause", "play"}) {
    EXPECT_FALSE(ViewRequest::parse(text)->steers()) << text;
  }
}

TEST(ViewRequest, RefusesEverythingElse) {
  for (const char* const text : {"",
                                 " ",
                                 "watches 1",
                                 "watch 1 2 3 4 5",
                                 "watch -1",
                                 "watch 4294967296",
                                 "watch x",
                                 "tare",
                                 "tare 1 2",
                                 "tare 1.5",
                                 "mark",
                                 "mark ",
                                 "record",
                                 "record pause",
                                 "record start now",
                                 "seek",
                                 "seek nan",
                                 "seek inf",
                                 "seek -1",
                                 "seek 1e300",
                                 "seek 1s",
                                 "pause 1",
                                 "HOLD"}) {
    EXPECT_FALSE(ViewRequest::parse(text)) << text;
  }
  EXPECT_FALSE(ViewRequest::parse("mark " + std::string(ViewRequest::kMaxLabel + 1, 'x')));
}

TEST(ViewRequest, ALabelIsOneLine) {
  EXPECT_EQ(ViewRequest::parse("mark a\nb\x1b[2Jc\x7f")->label, "a b [2Jc ");
}

TEST(ViewRequest, TakesAnyBytes) {
  Random random(1);
  const std::string alphabet("watchremkdsoply 0123456789.-e\0\xff\n", 33);
  for (int i = 0; i < 20'000; ++i) {
    std::string text;
    for (std::size_t length = random.next() % 40; length > 0; --length) {
      text += alphabet[random.next() % alphabet.size()];
    }
    const auto request = ViewRequest::parse(text);
    if (request) {
      EXPECT_LE(request->neurons.size(), ViewRequest::kMaxWatched);
    }
  }
}

}  // namespace
}  // namespace merkel
