#include "drivers/probes/device_opening.hpp"

#include <gtest/gtest.h>

#include "drivers/protocols/protocol_table.hpp"

namespace merkel {
namespace {

TEST(FailedOpening, AdvisesOnlyProtocolsThatThePortCarries) {
  const std::string_view lines = "0.119 N\r\n0.120 N\r\n0.121 N\r\n";
  const Bytes heard(lines.begin(), lines.end());
  ASSERT_EQ(likely_protocol(heard), "mark10");
  const auto sentence = [&heard](const char* scheme) {
    ProtocolCounts counts;
    counts.bytes = heard.size();
    return no_valid_data({.name = "port",
                          .scheme = scheme,
                          .protocol = "hbf1",
                          .hint = "the cable",
                          .waited = std::chrono::milliseconds{1500},
                          .protocol_error = "",
                          .counts = counts,
                          .heard = heard})
        .sentence;
  };
  EXPECT_EQ(sentence("serial"),
            "the device at port does not use the protocol hbf1: its data looks like mark10, so use "
            "protocol=mark10");
  const std::string other =
      "the device at port sent 27 bytes in 1.5 s that are not hbf1 readings: it sent \"0.119 N\"; "
      "check what it is set to send, and the protocol and its options";
  EXPECT_EQ(sentence("tcp"), other);
  EXPECT_EQ(sentence("udp"), other);
}

TEST(FailedOpening, QuotesTheFirst32BytesAndBlamesTheLineOnlyForNoise) {
  Bytes heard;
  for (unsigned i = 0; i < 40; ++i) heard.push_back(static_cast<std::uint8_t>(0x80 + i));
  FailedOpening opening = {.name = "port",
                           .scheme = "serial",
                           .protocol = "hbf1",
                           .hint = "the baud rate",
                           .waited = std::chrono::milliseconds{1500},
                           .protocol_error = "",
                           .counts = {},
                           .heard = heard,
                           .expected = "frames"};
  opening.counts.bytes = heard.size();
  std::string bytes;
  for (unsigned i = 0; i < 32; ++i) {
    bytes += std::string(" ") + "89"[i / 16] + "0123456789ABCDEF"[i % 16];
  }
  EXPECT_EQ(no_valid_data(opening).sentence,
            "the device at port sent 40 bytes in 1.5 s that are not hbf1 readings: it sent the 40 "
            "bytes" +
                bytes + " ..., expected: frames; check the baud rate");
  opening.notices = {"the gauge reports *22: value too large"};
  EXPECT_EQ(no_valid_data(opening).sentence,
            "the device at port cannot be read: the gauge reports *22: value too large");
}

TEST(ProtocolEntry, IsCarriedBySomePorts) {
  const auto carried = [](std::string_view scheme) {
    std::string names;
    for (const ProtocolEntry& entry : protocol_table()) {
      if (is_carried(entry, scheme)) names.append(entry.name).append(" ");
    }
    return names + (is_carried(ati_rdt_entry(), scheme) ? "ati_rdt" : "");
  };
  EXPECT_EQ(carried("serial"), "hbf1 csv mark10 esm grbl optoforce zaber ");
  EXPECT_EQ(carried("usb"), carried("serial"));
  EXPECT_EQ(carried("tcp"), "hbf1 csv ");
  EXPECT_EQ(carried("udp"), "csv ati_rdt");
}

}  // namespace
}  // namespace merkel
