#pragma once

#include "drivers/protocols/line_splitter.hpp"
#include "drivers/protocols/protocol.hpp"

namespace merkel {

/// Base of protocols with text lines: splits the bytes, counts lines that are too long, and leaves
/// the content to the derived class.
class LineProtocol : public Protocol {
 public:
  void take(std::span<const std::uint8_t> bytes, std::chrono::nanoseconds arrival,
            DeviceStream& stream) final {
    stream.counts.bytes += bytes.size();
    for (const std::uint8_t byte : bytes) {
      const auto line = lines_.take(byte);
      if (lines_.take_too_long() > 0) {
        ++stream.counts.damaged;
        stream.rejected = stream.answer = lines_.beginning();
      }
      if (!line) continue;
      const std::uint64_t bad = stream.counts.bad();
      if (!line->empty()) stream.answer = *line;
      read_line(*line, arrival, stream);
      if (stream.counts.bad() > bad) stream.rejected = stream.answer;
    }
  }

 protected:
  /// \param line  without its line end; empty only if lines_ keeps such lines.  \param arrival time
  /// of its last byte
  virtual void read_line(std::string_view line, std::chrono::nanoseconds arrival,
                         DeviceStream& stream) = 0;

  LineSplitter lines_;
};

}  // namespace merkel
