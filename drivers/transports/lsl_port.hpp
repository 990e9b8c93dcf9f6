#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "drivers/transports/transport.hpp"

namespace merkel {

/// A Lab Streaming Layer stream as a port that sends lines: `time_s` on this machine's monotonic
/// clock, then the channels of the stream. The protocol csv parses them.
struct LslStream {
  struct Channel {
    std::string label;
    std::string unit;
  };
  std::unique_ptr<Transport> port;
  std::vector<Channel> channels;  ///< from its description; labels and units may be empty
  double rate_Hz = 0.0;           ///< nominal; 0: irregular
};

/// Opens the stream of that name; waits two seconds for it. If its outlet closes, the device is
/// disconnected; reopening the port accepts only the same source and number of channels.
/// \param host  the machine of the outlet; empty: this one
[[nodiscard]] Expected<LslStream, SetupError> open_lsl_stream(const std::string& name,
                                                              const std::string& host);

}  // namespace merkel
