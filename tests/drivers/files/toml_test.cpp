#include "drivers/files/toml.hpp"

#include <string>
#include <string_view>

#include <gtest/gtest.h>

namespace merkel {
namespace {

std::string value_of(std::string_view text) {
  const auto table = parse_toml(text);
  if (!table) return "line " + std::to_string(table.error().line) + ": " + table.error().reason;
  return (*table)["a"].value_or(std::string("no text"));
}

TEST(Toml, KeepsQuotedTextAsItIs) {
  EXPECT_EQ(value_of("a = \"é → ü\" # é"), "é → ü");
  EXPECT_EQ(value_of("a='é'"), "é");
  EXPECT_EQ(value_of("\"é\" = 1\na = \"\"\"\né\n\"\"\"\n"), "é\n");
}

TEST(Toml, KeepsQuotedTextWithQuotesAndEscapes) {
  EXPECT_EQ(value_of(R"(a = "\"é\" # \\")"), "\"é\" # \\");
  EXPECT_EQ(value_of(R"(a = '\')"), "\\");
  EXPECT_EQ(value_of("a = \"\"\"\"\"é\"\"\"\"\""), "\"\"é\"\"");
  EXPECT_EQ(value_of("a = ''''é'''''"), "'é''");
  EXPECT_EQ(value_of("b = \"\"\na = ''"), "");
  EXPECT_EQ(value_of("a = \"\"\"\\\n   b é\"\"\""), "b é");
}

TEST(Toml, SkipsAByteOrderMark) {
  EXPECT_EQ(value_of("\xEF\xBB\xBF"
                     "a = 'b'"),
            "b");
}

TEST(Toml, RefusesWhatTheParserIsUndefinedFor) {
  const std::string outside = "this line has a non-ASCII character outside quotes";
  EXPECT_EQ(value_of("\né = 1"), "line 2: " + outside);
  EXPECT_EQ(value_of("a = é"), "line 1: " + outside);
  EXPECT_EQ(value_of("a = 'b'é"), "line 1: " + outside);
  EXPECT_EQ(value_of("a = 1\u00A0"), "line 1: " + outside);
  EXPECT_EQ(value_of("a = \"\"\"\\\n  é\"\"\""),
            "line 2: the text after a trimmed line end must start with an ASCII character");
  EXPECT_EQ(value_of("a = \"\\é\""),
            "line 1: a backslash in quotes is followed by a non-ASCII character");
}

TEST(Toml, ReportsTheLineOfMalformedText) {
  for (const std::string_view text :
       {"\na = 1\"é\"", "\na = true'é'", "\na = 1979-05-27 \"é\"", "\na = 1=\"é\"", "\na = \"é",
        "\na = [1[\"é\"]]", "\n[a]\"é\"", "\na = \"é\n\"", "\na = '\x9f'"}) {
    EXPECT_EQ(value_of(text).rfind("line 2: ", 0), 0U) << text << ": " << value_of(text);
  }
  EXPECT_EQ(value_of("[#").rfind("line 1: ", 0), 0U) << value_of("[#");
}

TEST(Toml, RefusesKeysThatNestWithoutLimit) {
  std::string text = "a";
  for (int i = 0; i < 500'000; ++i) text += ".a";
  EXPECT_EQ(value_of(text + " = 1"), "line 1: a dotted key has more than 16 parts");
  EXPECT_EQ(value_of("[" + text + "]"), "line 1: a dotted key has more than 16 parts");
  std::string deep = "b = ";
  for (int i = 0; i < 100'000; ++i) deep += "{a.a.a.a.a.a.a.a = ";
  EXPECT_EQ(value_of(deep).rfind("line 1: ", 0), 0U);
  std::string numbers = "c = [0.1";
  for (int i = 0; i < 1000; ++i) numbers += ", 0.1";
  EXPECT_EQ(value_of(numbers + "]\na.b.c.d = 1"), "no text");
}

}  // namespace
}  // namespace merkel
