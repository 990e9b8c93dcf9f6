#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "core/expected.hpp"
#include "drivers/protocols/protocol.hpp"
#include "drivers/protocols/simulated_device.hpp"
#include "drivers/uri.hpp"

namespace merkel {

/// A protocol on a byte stream, as the program uses it. A new protocol is one file and one line in
/// the table.
struct ProtocolEntry {
  std::string_view name;  ///< in URIs: protocol=name
  std::string_view what;  ///< for display
  int baud = 115200;      ///< default rate
  Expected<std::unique_ptr<Protocol>, SetupError> (*make)(UriOptions&) = nullptr;
  /// \param channels  ProbeSample::Channel bits of the trace to be played
  std::unique_ptr<SimulatedDevice> (*simulate)(std::uint32_t channels) = nullptr;
  /// Options for trying the protocol on an unknown stream.
  std::string_view options;
  /// ProbeSample::Channel bits; a trace must have one of them to be played.
  std::uint32_t plays = 0;
  /// True if the protocol needs datagrams and has no framing in a byte stream.
  bool datagrams = false;
  /// True if the device never sends without a request: lines that merely arrive are of another one.
  bool only_answers = false;
};

/// ATI's protocol, only over UDP: not in the table of protocols for byte streams.
[[nodiscard]] const ProtocolEntry& ati_rdt_entry() noexcept;

[[nodiscard]] std::span<const ProtocolEntry> protocol_table() noexcept;

/// Whether ports of a scheme (serial, usb, tcp, udp) carry a protocol.
[[nodiscard]] bool is_carried(const ProtocolEntry& entry, std::string_view scheme) noexcept;

/// An entry by its name, or an error with the nearest name.
[[nodiscard]] Expected<const ProtocolEntry*, SetupError> find_protocol(std::string_view name);

/// The protocol that bytes appear to have: its parser finds at least two frames, and more good ones
/// than damaged ones. Empty if there is none.
[[nodiscard]] std::string_view likely_protocol(std::span<const std::uint8_t> bytes);

}  // namespace merkel
