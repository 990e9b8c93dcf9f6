#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/expected.hpp"
#include "drivers/protocols/analog_scans.hpp"
#include "drivers/transports/transport.hpp"

namespace merkel {

/// What to scan of a data-acquisition card.
struct ComediSettings {
  std::string node;                ///< "/dev/comedi0"
  std::vector<unsigned> channels;  ///< at least one
  double rate_Hz = 10'000.0;       ///< scans per second
  /// V, of each channel or of all; empty: the widest that the card has.
  std::vector<std::pair<double, double>> ranges_V;
  std::string reference = "ground";  ///< or common, differential, other
};

/// A card that scans its channels at intervals of its own clock, as a port that sends scans.
struct ComediCard {
  std::unique_ptr<Transport> port;
  AnalogFormat format;  ///< with the card's own conversions; without columns
};

/// Opens a card and starts its scans. If the card's buffer overflows, its scans end: they are
/// started anew (TransportInfo::restarts). The card must come within 1 % of the rate.
[[nodiscard]] Expected<ComediCard, SetupError> open_comedi_card(const ComediSettings& settings);

}  // namespace merkel
