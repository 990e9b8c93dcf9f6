#include "drivers/probes/device_opening.hpp"

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>

#include "drivers/printable_text.hpp"
#include "drivers/protocols/protocol_table.hpp"

namespace merkel {
namespace {

std::string_view text_of_bytes(std::span<const std::uint8_t> bytes) noexcept {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

std::string answer_and_expected(std::string_view answer, const std::string& expected) {
  return quoted_answer(answer) + (expected.empty() ? "" : ", expected: " + expected);
}

std::string what_to_check(std::string_view answer, std::string_view scheme,
                          const std::string& hint) {
  const bool network = scheme == "tcp" || scheme == "udp";
  const bool line = scheme == "serial" || scheme == "usb";
  if (!network && !(line && is_text(answer))) return hint;
  return "what it is set to send, and the protocol and its options";
}

SetupError no_valid_data(const FailedOpening& opening) {
  const auto& counts = opening.counts;
  const std::string device = "the device at " + opening.name;
  const auto error = [](std::string sentence) {
    return SetupError{.kind = SetupError::Kind::kUnavailable, .sentence = std::move(sentence)};
  };
  const auto tenths = opening.waited.count() / 100;
  const std::string seconds =
      std::to_string(tenths / 10) + "." + std::to_string(tenths % 10) + " s";
  if (!opening.protocol_error.empty()) {
    return error(device + " cannot be read: " + printable_text(opening.protocol_error));
  }
  if (counts.bytes == 0) {
    return error(device + " has sent nothing for " + seconds +
                 ": check that it is switched on, streaming, and " + opening.hint +
                 "; a longer wait is timeout_ms=10000");
  }
  const std::string_view likely = likely_protocol(opening.heard);
  const auto entry = find_protocol(likely);
  if (entry && likely != opening.protocol && is_carried(**entry, opening.scheme)) {
    return error(device + " does not use the protocol " + opening.protocol +
                 ": its data looks like " + std::string(likely) +
                 ", so use protocol=" + std::string(likely));
  }
  if (!opening.notices.empty()) {
    return error(device + " cannot be read: " + printable_text(opening.notices.back()));
  }
  const std::string_view answer =
      opening.rejected.empty() ? text_of_bytes(opening.heard) : std::string_view(opening.rejected);
  const std::string sent = answer_and_expected(answer, opening.expected);
  if (counts.readings == 0 && counts.refused > counts.without_value) {
    return error(device + " has sent " + std::to_string(counts.refused) +
                 " readings, each beyond 10 kN or 1 m, such as " + quoted_answer(answer) +
                 ": check its units (is the unit mN or µm?)" +
                 (opening.protocol == "csv" ? ", and name them, for example columns=force_mN; "
                                              "for raw counts, use that and merkel calibrate"
                                            : ""));
  }
  return error(device + " sent " + std::to_string(counts.bytes) + " bytes in " + seconds +
               " that are not " + opening.protocol + " readings: it sent " + sent + "; check " +
               what_to_check(answer, opening.scheme, opening.hint));
}

Unexpected<SetupError> closed_while_opening(const FailedOpening& opening) {
  if (opening.scheme != "tcp") {
    return unavailable(opening.name + " was unplugged while it was being opened");
  }
  if (opening.heard.empty()) {
    return unavailable(opening.name +
                       " closed the connection before it sent anything: check that the program "
                       "there serves " +
                       opening.protocol + " to this machine");
  }
  const std::string_view text = text_of_bytes(opening.heard);
  const std::string what = text.starts_with("HTTP/") ? ": it is a web server" : "";
  return unavailable(opening.name + " closed the connection after " +
                     std::to_string(opening.counts.bytes) + " bytes that are not " +
                     opening.protocol + " readings, beginning with " + quoted_answer(text) + what +
                     "; check the host, the port and the protocol");
}

Expected<ProbeCalibration, SetupError> read_calibration_of_device(
    const std::string& file, const std::optional<std::string>& serial_number,
    std::uint32_t channels, const ProbeCalibration* chosen) {
  ProbeCalibration calibration;
  if (!file.empty()) {
    auto read = read_calibration(file);
    if (!read) return Unexpected<SetupError>(read.error());
    calibration = std::move(*read);
    if (serial_number && !calibration.serial_number.empty() &&
        calibration.serial_number != *serial_number) {
      return bad_input("the calibration " + file + " belongs to the device with serial number " +
                       calibration.serial_number + ", but this one has " +
                       (serial_number->empty() ? "none" : *serial_number) +
                       ": calibrate this device, or plug in the other one");
    }
    for (std::size_t i = 0; i < calibration.channels.size(); ++i) {
      auto& channel = calibration.channels[i];
      if (chosen != nullptr) {
        const auto& own = chosen->channels[i];
        if (channel && own && !channel->name.empty() && channel->name != own->name) {
          return bad_input("the calibration " + file + " belongs to the channel " + channel->name +
                           ", but the " + std::string(kProbeChannels[i].name) +
                           " of this probe is " + own->name +
                           ": calibrate each channel by its own file");
        }
        if (channel && own) {
          channel->source = own->source;
          channel->name = own->name;
        } else {
          channel = own;
        }
        continue;
      }
      if (channel && (channels & bit_of(channel->source)) == 0U) {
        const std::string from = "the calibration " + file + " takes " +
                                 std::string(kProbeChannels[i].name) + " from the channel ";
        return bad_input(
            is_named(channel->source)
                ? from + channel->name + ", which no probe takes: add #" + channel->name +
                      " to the end of the URI"
                : from +
                      std::string(kDeviceChannelNames[static_cast<std::size_t>(channel->source)]) +
                      ", which this device does not have");
      }
    }
  }
  if (chosen == nullptr) calibration.complete(channels);
  if (chosen != nullptr && file.empty()) calibration.channels = chosen->channels;
  return calibration;
}

}  // namespace merkel
