#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/expected.hpp"
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

/// A card that scans its channels at intervals of its own clock, as a port that sends scans: one
/// raw value of each channel after the other.
struct ComediCard {
  /// The card's own conversion to V: a polynomial of raw − origin.
  struct Channel {
    std::array<double, 4> coefficients{};
    double origin = 0.0;
    std::uint32_t largest = 0;
  };
  std::unique_ptr<Transport> port;
  std::vector<Channel> channels;
  std::size_t sample_bytes = 2;  ///< or 4, in the host's order
  std::chrono::nanoseconds period{0};
};

/// Opens a card and starts its scans. If the card's buffer overflows, its scans end: they are
/// started anew (TransportInfo::restarts). The card must come within 1 % of the rate.
[[nodiscard]] Expected<ComediCard, SetupError> open_comedi_card(const ComediSettings& settings);

}  // namespace merkel
