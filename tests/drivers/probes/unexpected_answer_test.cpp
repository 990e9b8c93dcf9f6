// A device that answers, but not as expected, is quoted.
#include <chrono>
#include <string>
#include <vector>

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "drivers/printable_text.hpp"
#include "drivers/probes/open_probe.hpp"
#include "tests/drivers/simulation/line_printer.hpp"
#include "tests/text_has.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;

std::string sentence_of_refusal(const std::string& uri) {
  const auto probe = open_probe(uri);
  return probe ? "" : probe.error().sentence;
}

/// The error of a serial device that prints a line again and again.
std::string refusal_of_lines(const std::string& line, const std::string& options) {
  LinePrinter printer(line);
  return sentence_of_refusal("serial:" + printer.name() + "?timeout_ms=400&" + options);
}

TEST(QuotedAnswer, IsTheFirstLineOrTheFirst32Bytes) {
  EXPECT_EQ(quoted_answer("\r\n0.1,0.2\r\n0.3"), "\"0.1,0.2\"");
  EXPECT_EQ(quoted_answer(std::string("\x12\x34\xFF", 3)), "the 3 bytes 12 34 FF");
  EXPECT_TRUE(quoted_answer(std::string(100, '\xAA')).ends_with("AA AA ..."));
  EXPECT_EQ(quoted_answer(std::string(33, '\0')).size(),
            std::string("the 33 bytes ...").size() + 3 * 32);
  EXPECT_EQ(quoted_answer(""), "");
}

TEST(UnexpectedAnswer, IsQuotedWithWhatWasExpected) {
  const struct {
    const char* line;
    const char* options;
    std::vector<std::string> words;
  } cases[] = {
      {"1,0.5,0.6",
       "protocol=csv&columns=time_us,taxel_kPa*3",
       {"\"1,0.5,0.6\"",
        "4 values in a line (time_us,taxel1_kPa,taxel2_kPa,taxel3_kPa), but this one has 3 values"}},
      {"1,0.5,0.6,0.7,0.8",
       "protocol=csv&columns=time_us,taxel_kPa*3",
       {"\"1,0.5,0.6,0.7,0.8\"", "but this one has 5 values"}},
      {"{\"t\":0.001,\"thumb\":0.2}",
       "protocol=csv",
       {"{\"t\":0.001,\"thumb\":0.2}", "state no units", "columns=t:time_s,thumb:force_N"}},
      {"{\"t\":0.001,\"force_N\":0.2",
       "protocol=csv&columns=force_N",
       {"{\"t\":0.001,\"force_N\":0.2", "1 value in a line (force_N)"}},
      {"30000", "protocol=csv&columns=force_N", {"such as \"30000\"", "is the unit mN"}},
      {"*22", "protocol=mark10", {"*22: value too large: set rate_hz"}},
      {"@01 2 OK IDLE -- 7",
       "protocol=zaber&um_per_step=1",
       {"\"@01 2 OK IDLE -- 7\"", "address 1 and axis 1 (stage_axis)"}},
      {"@01 1 OK IDLE -- 7:00",
       "protocol=zaber&um_per_step=1",
       {"\"@01 1 OK IDLE -- 7:00\"", "this one's checksum is wrong"}},
      {"hello", "protocol=hbf1&baud=115200", {"\"hello\"", "HBF1"}},
  };
  for (const auto& each : cases) {
    const std::string sentence = refusal_of_lines(each.line, each.options);
    for (const std::string& word : each.words) EXPECT_TRUE(has(sentence, word)) << sentence;
    EXPECT_FALSE(has(sentence, "baud")) << sentence;  // text arrived as text
  }
}

TEST(UnexpectedAnswer, ALineWithoutEndIsQuotedWithTheLimit) {
  std::string line = "0.25";
  while (line.size() < 9000) line += ",0.5";
  const std::string sentence = refusal_of_lines(line, "protocol=csv&columns=taxel_kPa*16");
  EXPECT_TRUE(has(sentence, "lines of less than 8192 bytes")) << sentence;
  EXPECT_TRUE(has(sentence, "\"0.25,0.5")) << sentence;
}

/// Answers the request of a Net F/T by datagrams of a length.
std::string refusal_of_datagrams(std::size_t bytes) {
  const int box = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in own{};
  own.sin_family = AF_INET;
  own.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t length = sizeof own;
  EXPECT_EQ(::bind(box, reinterpret_cast<const sockaddr*>(&own), sizeof own), 0);
  ::getsockname(box, reinterpret_cast<sockaddr*>(&own), &length);
  const timeval patience{.tv_sec = 3, .tv_usec = 0};
  ::setsockopt(box, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  std::jthread sender([box, bytes](const std::stop_token& stop) {
    std::vector<std::uint8_t> data(bytes, 0xC7);
    sockaddr_in host{};
    socklen_t size = sizeof host;
    std::uint8_t request[64];
    if (::recvfrom(box, request, sizeof request, 0, reinterpret_cast<sockaddr*>(&host), &size) < 0)
      return;
    while (!stop.stop_requested()) {
      ::sendto(box, data.data(), data.size(), 0, reinterpret_cast<const sockaddr*>(&host), size);
      std::this_thread::sleep_for(milliseconds{4});
    }
  });
  const std::string sentence = sentence_of_refusal(
      "udp:127.0.0.1:" + std::to_string(ntohs(own.sin_port)) + "?protocol=ati_rdt&timeout_ms=300");
  sender = {};
  ::close(box);
  return sentence;
}

TEST(UnexpectedAnswer, DatagramsOfAnotherLengthAreNotSilence) {
  for (const std::size_t bytes : {35U, 37U, 72U}) {
    const std::string sentence = refusal_of_datagrams(bytes);
    EXPECT_TRUE(has(sentence, "the " + std::to_string(bytes) + " bytes C7 C7")) << sentence;
    EXPECT_TRUE(has(sentence, "expected: records of 36 bytes")) << sentence;
    EXPECT_FALSE(has(sentence, "sent nothing")) << sentence;
    EXPECT_FALSE(has(sentence, "firewall")) << sentence;
  }
}

TEST(UnexpectedAnswer, DuringARunIsQuotedInTheNoticeAndTheCounts) {
  LinePrinter printer("0.5");
  const auto probe =
      open_probe("serial:" + printer.name() + "?protocol=csv&columns=force_N&timeout_ms=400");
  ASSERT_TRUE(probe.has_value()) << probe.error().sentence;
  std::vector<ProbeSample> samples(64);
  std::string said;
  for (int reads = 0; reads < 2000 && !has(said, "no longer"); ++reads) {
    ASSERT_TRUE((*probe)->read(samples, milliseconds{5}).has_value());
    if (reads == 10) printer.print("0.5 N, over range");
    for (const std::string& notice : (*probe)->take_notices()) said += notice + "\n";
  }
  EXPECT_TRUE(has(said, "it sent \"0.5 N, over range\", expected: 1 value in a line")) << said;
  EXPECT_TRUE(has((*probe)->device_counts()->unexpected, "\"0.5 N, over range\""));
}

}  // namespace
}  // namespace merkel
