#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/expected.hpp"
#include "drivers/calibration/probe_calibration.hpp"
#include "drivers/protocols/protocol.hpp"

namespace merkel {

/// A device that sent no valid data while it was being opened.
struct FailedOpening {
  std::string name;      ///< of the port
  std::string scheme;    ///< of the port: "serial", "tcp", …
  std::string protocol;  ///< its name
  std::string hint;      ///< what to check
  std::chrono::milliseconds waited{0};
  std::string protocol_error;  ///< what the protocol reported; empty for nothing
  ProtocolCounts counts;
  std::span<const std::uint8_t> heard;    ///< the first bytes
  std::string rejected = {};              ///< an answer that was not as expected; empty for none
  std::string expected = {};              ///< what it should have been: Protocol::expected()
  std::vector<std::string> notices = {};  ///< what the device reported
};

/// An answer and what was expected: "\"1,2\", expected: 3 values in a line".
[[nodiscard]] std::string answer_and_expected(std::string_view answer, const std::string& expected);

/// What to check after an answer that was not as expected: not the line or the address, if it is
/// text or came over a network. \param hint  what to check after bytes of noise
[[nodiscard]] std::string what_to_check(std::string_view answer, std::string_view scheme,
                                        const std::string& hint);

/// Describes what the device sent and what to do.
[[nodiscard]] SetupError no_valid_data(const FailedOpening& opening);

/// Describes a device that went away while it was being opened; a network peer closed the
/// connection.
[[nodiscard]] Unexpected<SetupError> closed_while_opening(const FailedOpening& opening);

/// Reads the calibration of a device and checks that it is for this one.
/// \param file  empty: every channel as the device sends it
/// \param serial_number  of the device; nothing: a recording, which has none
/// \param channels  DeviceChannel bits that the device has
/// \param chosen  the channels that a probe names: their gains and zeros are those of the file, and
/// no other channels are used; null: none named
[[nodiscard]] Expected<ProbeCalibration, SetupError> read_calibration_of_device(
    const std::string& file, const std::optional<std::string>& serial_number,
    std::uint32_t channels, const ProbeCalibration* chosen = nullptr);

}  // namespace merkel
