#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/expected.hpp"
#include "drivers/transports/transport.hpp"

namespace merkel {

/// A stream of the Lab Streaming Layer as a port that prints lines: `time_s` on this machine's
/// monotonic clock, then the stream's channels. The protocol csv reads them.
struct LslStream {
  struct Channel {
    std::string label;
    std::string unit;
  };
  std::unique_ptr<Transport> port;
  std::vector<Channel> channels;  ///< as the stream describes them; empty where it does not
  double rate_Hz = 0.0;           ///< as the stream states it; 0: irregular
};

/// Opens the stream of that name. Waits two seconds for it. An outlet that goes is a disconnected
/// device; the port looks for it again.
/// \param host  the machine that sends it; empty: this one
[[nodiscard]] Expected<LslStream, SetupError> open_lsl_stream(const std::string& name,
                                                              const std::string& host);

}  // namespace merkel
