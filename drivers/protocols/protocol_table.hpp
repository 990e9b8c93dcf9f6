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

/// What the program must know to speak a protocol on a byte stream. A new one is one file and one
/// line in the table.
struct ProtocolEntry {
  std::string_view name;  ///< in URIs: protocol=name
  std::string_view what;  ///< for people
  int baud = 115200;      ///< where the user gives none
  Expected<std::unique_ptr<Protocol>, SetupError> (*make)(UriOptions&) = nullptr;
  /// \param channels  ProbeSample::Channel bits of the trace to be played
  std::unique_ptr<SimulatedDevice> (*simulate)(std::uint32_t channels) = nullptr;
  /// Options with which an unknown stream is tried.
  std::string_view options;
  /// ProbeSample::Channel bits of which a trace must have one to be played.
  std::uint32_t plays = 0;
  /// Only for datagrams: has no frames in a stream of bytes.
  bool datagrams = false;
};

/// ATI's, which is spoken over UDP alone: not in the table of protocols for streams of bytes.
[[nodiscard]] const ProtocolEntry& ati_rdt_entry() noexcept;

[[nodiscard]] std::span<const ProtocolEntry> protocol_table() noexcept;

/// An entry by its name; or a sentence that names the nearest.
[[nodiscard]] Expected<const ProtocolEntry*, SetupError> find_protocol(std::string_view name);

/// The protocol that bytes seem to be of: one whose parser finds at least two frames, and more good
/// ones than damaged. Empty if none does.
[[nodiscard]] std::string_view likely_protocol(std::span<const std::uint8_t> bytes);

}  // namespace merkel
