#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/records/probe_sample.hpp"
#include "core/records/raw_frame.hpp"
#include "drivers/calibration/probe_calibration.hpp"
#include "drivers/protocols/protocol_table.hpp"

namespace merkel {

/// The result of parsing a device's recorded bytes.
struct ParsedAgain {
  std::vector<ProbeSample> samples;  ///< from the start on, without a calibration; no times
  ProtocolCounts counts;             ///< damaged and lost from the start on
  ProtocolCounts recorded;           ///< the same, from the recorded frames
  std::uint64_t opened = 0;
  std::uint64_t sent = 0;
};

/// Passes the frames of one port to a new parser, as its probe did. \param text  the probe's URI
inline ParsedAgain parse_again(const std::string& text, std::span<const RawFrame> frames) {
  const auto uri = Uri::parse(text);
  EXPECT_TRUE(uri.has_value());
  UriOptions options(*uri);
  const auto entry = find_protocol(options.text("protocol", ""));
  EXPECT_TRUE(entry.has_value());
  const auto parser = (*entry)->make(options);
  EXPECT_TRUE(parser.has_value());
  ParsedAgain all;
  DeviceStream stream;
  Bytes arrived;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const RawFrame& frame = frames[i];
    all.recorded.frames += frame.parsed;
    all.recorded.damaged += frame.damaged;
    all.recorded.lost += frame.lost;
    switch (frame.kind) {
      case RawFrame::Kind::kOpened:
        ++all.opened;
        (*parser)->begin(frame.time, stream);
        break;
      case RawFrame::Kind::kStarted:
        stream.readings.clear();
        stream.counts.damaged = stream.counts.lost = 0;
        all.recorded.damaged = all.recorded.lost = 0;
        (*parser)->start(frame.time, stream);
        break;
      case RawFrame::Kind::kSent:
        ++all.sent;
        static_cast<void>((*parser)->poll(frame.time, stream));
        break;
      case RawFrame::Kind::kReceived: {
        const auto bytes = frame.content();
        arrived.insert(arrived.end(), bytes.begin(), bytes.end());
        const bool more = i + 1 < frames.size() && frames[i + 1].time == frame.time &&
                          frames[i + 1].kind == RawFrame::Kind::kReceived;
        if (more) break;
        (*parser)->take(std::exchange(arrived, {}), frame.time, stream);
        break;
      }
    }
    stream.outgoing.clear();
  }
  const auto calibration = ProbeCalibration::natural((*parser)->channels());
  for (const DeviceReading& reading : stream.readings) {
    all.samples.push_back(calibration.apply(reading));
    all.samples.back().arrival = reading.arrival;
  }
  all.counts = stream.counts;
  return all;
}

/// Expects every read sample again, in order and with its arrival.
inline void expect_same_samples(std::span<const ProbeSample> read,
                                std::span<const ProbeSample> again) {
  ASSERT_GE(again.size(), read.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    ASSERT_EQ(again[i].arrival, read[i].arrival) << i;
    ASSERT_EQ(again[i].channels, read[i].channels) << i;
    ASSERT_EQ(again[i].depth_mm, read[i].depth_mm) << i;
    ASSERT_EQ(again[i].force_mN, read[i].force_mN) << i;
    ASSERT_EQ(again[i].x_mm, read[i].x_mm) << i;
    ASSERT_EQ(again[i].y_mm, read[i].y_mm) << i;
  }
}

}  // namespace merkel
