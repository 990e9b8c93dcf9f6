#include "tools/connect/recognition.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <span>

#include <fmt/core.h>

#include "core/parameters/parameter_error.hpp"
#include "core/units.hpp"
#include "drivers/calibration/probe_calibration.hpp"
#include "drivers/printable_text.hpp"
#include "drivers/probes/channel_selection.hpp"
#include "drivers/protocols/csv_text_style.hpp"
#include "drivers/protocols/line_splitter.hpp"
#include "drivers/protocols/protocol_makers.hpp"
#include "drivers/protocols/protocol_table.hpp"
#include "drivers/transports/host_name.hpp"
#include "drivers/transports/network_port.hpp"
#include "drivers/transports/serial_port.hpp"
#include "drivers/uri.hpp"
#include "tools/connect/csv_readings.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr std::array<int, 11> kBauds = {115200, 500000, 460800, 9600,   57600, 1000000,
                                        19200,  38400,  230400, 921600, 250000};
constexpr milliseconds kBoot{
    3000};  ///< a board that resets when its port is opened is silent so long
constexpr milliseconds kListening{700};  ///< from the first byte
constexpr milliseconds kListeningToSlowLines{2500};
constexpr std::ptrdiff_t kEnoughLines = 8;
constexpr milliseconds kAsking{900};
constexpr milliseconds kAtOnce{400};  ///< a device that streams is heard by then

nanoseconds now() {
  return std::chrono::duration_cast<nanoseconds>(
      std::chrono::steady_clock::now().time_since_epoch());
}

struct OpeningBytes {
  Bytes bytes;
  double seconds = 0.0;    ///< since the first byte
  nanoseconds silence{0};  ///< before the first byte
};

/// Opens the port of an address at a baud rate.
Expected<std::unique_ptr<Transport>, SetupError> open_port(const Uri& uri, int baud, bool datagrams,
                                                           bool allow_remote) {
  if (uri.scheme == "serial") return open_serial({.device = uri.path, .baud = baud});
  const auto address = HostAndPort::parse(uri.path);
  if (!address) {
    return bad_input("\"" + uri.text + "\" needs a host and a port, for example " + uri.scheme +
                     ":127.0.0.1:5000");
  }
  if (uri.scheme == "tcp") return open_tcp_port(*address);
  return open_udp_port({.address = *address,
                        .listen = !datagrams,
                        .allow_remote = allow_remote,
                        .datagram_bytes = datagrams ? kAtiRecordBytes : 0});
}

/// \param whole  the bytes start with the start of a line, and empty lines are lines
std::vector<std::string> lines_of(std::span<const std::uint8_t> bytes, bool whole = false) {
  std::vector<std::string> lines;
  LineSplitter splitter;
  splitter.reset(whole);
  if (whole) splitter.keep_empty_lines();
  for (const std::uint8_t byte : bytes) {
    if (const auto line = splitter.take(byte)) lines.emplace_back(*line);
  }
  return lines;
}

std::string_view text_of(std::span<const std::uint8_t> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Listens: long enough for the lines of a slow device, and for a board that boots.
OpeningBytes listen(Transport& port) {
  OpeningBytes heard;
  std::array<std::uint8_t, 4096> buffer{};
  const nanoseconds begin = now();
  nanoseconds first{0};
  nanoseconds end = begin + kBoot;
  while (now() < end) {
    const auto count = port.read(buffer, end - now());
    if (!count) break;
    if (*count > 0 && heard.bytes.empty()) {
      first = now();
      heard.silence = first - begin;
    }
    heard.bytes.insert(heard.bytes.end(), buffer.begin(),
                       buffer.begin() + static_cast<std::ptrdiff_t>(*count));
    if (heard.bytes.empty()) continue;
    const std::string_view text = text_of(heard.bytes);
    const bool frames = text.find("\n\n") != std::string_view::npos ||
                        text.find("\n\r\n") != std::string_view::npos;
    const bool slow = is_text(text) && (frames || std::count(heard.bytes.begin(), heard.bytes.end(),
                                                             '\n') < kEnoughLines);
    end = first + (slow ? kListeningToSlowLines : kListening);
  }
  heard.seconds = heard.bytes.empty() ? 0.0 : units::s_from(now() - first);
  return heard;
}

/// The text of a line, or the first bytes of a frame in hexadecimal.
std::string shown(std::span<const std::uint8_t> bytes) {
  if (bytes.empty()) return {};
  if (is_text(text_of(bytes))) {
    const auto lines = lines_of(bytes);
    if (!lines.empty()) return quoted_answer(lines.back());
  }
  return quoted_answer(text_of(bytes));
}

/// The channels of a device, with their values in a reading if there is one.
std::string meaning_of(const Protocol& protocol, const DeviceStream& stream) {
  constexpr std::size_t kMaxShown = 8;
  const std::vector<ChannelName> channels = protocol.channel_names();
  std::string text;
  for (std::size_t i = 0; i < std::min(channels.size(), kMaxShown); ++i) {
    const std::string name = in_unit_of_readings(channels[i]);
    const auto unit = name.rfind('_');
    const double value =
        stream.readings.empty() ? std::nan("") : stream.readings.back()[channels[i].channel];
    text += (i == 0 ? "" : ", ") + name.substr(0, unit) + " " +
            (std::isfinite(value) ? shortest_decimal(value) : "in") + " " + name.substr(unit + 1);
  }
  const std::size_t more = channels.size() - std::min(channels.size(), kMaxShown);
  return text + (more == 0 ? "" : " and " + std::to_string(more) + " more");
}

Reading reading_by(const ProtocolEntry& entry, const Protocol& protocol,
                   const DeviceStream& stream) {
  return {.protocol = std::string(entry.name),
          .style = entry.options.empty() ? "" : "&" + std::string(entry.options),
          .meaning = meaning_of(protocol, stream)};
}

/// Sends a protocol's requests to a port. \param boots  the device may be silent for a while first
/// \return what the protocol decodes, or nothing
std::optional<Reading> request_reading(Transport& port, const ProtocolEntry& entry, bool boots,
                                       std::string& received) {
  const auto uri = Uri::parse("serial:?" + std::string(entry.options));
  UriOptions options(*uri);
  const auto protocol = entry.make(options);
  if (!protocol) return std::nullopt;
  DeviceStream stream;
  Bytes heard;
  std::array<std::uint8_t, 4096> buffer{};
  const nanoseconds begin = now();
  const nanoseconds end = begin + (boots || (*protocol)->describes_itself() ? kBoot : kAsking);
  const auto exchange = [&](nanoseconds until, const auto& done) {
    while (now() < until && !done()) {
      const auto wake = (*protocol)->poll(now(), stream);
      if (!port.write(std::exchange(stream.outgoing, {}))) return;
      const nanoseconds next = wake ? std::min(until, *wake) : until;
      const auto count = port.read(buffer, std::max(next - now(), nanoseconds{0}));
      if (!count) return;
      const auto bytes = std::span<const std::uint8_t>(buffer).first(*count);
      if (heard.size() < 4096) heard.insert(heard.end(), bytes.begin(), bytes.end());
      (*protocol)->take(bytes, now(), stream);
    }
  };
  (*protocol)->begin(begin, stream);
  exchange(end, [&] { return (*protocol)->ready(); });
  if (!(*protocol)->channel_names().empty()) (*protocol)->start(now(), stream);
  exchange(std::max(end, now() + kAsking / 2), [&] { return stream.readings.size() > 3; });
  stream.outgoing.clear();
  (*protocol)->end(stream);
  static_cast<void>(port.write(stream.outgoing));
  if (stream.readings.empty() || stream.counts.frames <= stream.counts.damaged) return std::nullopt;
  received = shown(heard);
  return reading_by(entry, **protocol, stream);
}

/// The possible interpretations of bytes that arrived without a request.
std::vector<Reading> readings_of(const OpeningBytes& heard, std::string_view scheme) {
  const std::string_view likely = likely_protocol(heard.bytes);
  const auto entry = find_protocol(likely);
  if (entry && likely != "csv" && !(*entry)->only_answers && is_carried(**entry, scheme)) {
    const auto uri = Uri::parse("serial:?" + std::string((*entry)->options));
    UriOptions options(*uri);
    const auto protocol = (*entry)->make(options);
    DeviceStream stream;
    (*protocol)->begin(now(), stream);
    (*protocol)->take(heard.bytes, now(), stream);
    return {reading_by(**entry, **protocol, stream)};
  }
  if (!is_text(text_of(heard.bytes))) return {};
  std::vector<std::string> lines = lines_of(heard.bytes, true);
  // Unless a board has just booted, the first line may lack its beginning. A header does not: a
  // board prints it when its port is opened.
  const bool cut = heard.silence <= kAtOnce && !lines.empty() &&
                   parse_csv_field(lines.front(), false).number.has_value();
  if (cut) lines.erase(lines.begin());
  return readings_of_lines(std::move(lines), heard.seconds);
}

/// What the sender of such a text must change before anyone can read its numbers; empty: nothing.
std::string unreadable(std::string_view text) {
  if (!is_text(text)) return {};
  if (text.find_first_of("\r\n") == std::string_view::npos) {
    return " without the end of a line: let it send a newline after each";
  }
  const std::string advice =
      csv_advice(lines_of({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}));
  return advice.empty() ? "" : ", which does not tell numbers from text: " + advice;
}

SetupError nothing_made(const std::string& address, const std::string& received,
                        const std::string& to_change) {
  if (!to_change.empty()) {
    return {.kind = SetupError::Kind::kUnavailable,
            .sentence = "the device at " + address + " sends " + received + to_change};
  }
  return {.kind = SetupError::Kind::kUnavailable,
          .sentence = received.empty()
                          ? "the device at " + address +
                                " sends nothing, at any baud rate or in answer to any known "
                                "protocol: check that it is switched on and streaming"
                          : "the device at " + address + " sends " + received +
                                ", which matches no known protocol: if these are numbers, "
                                "describe them by protocol=csv&columns=…; merkel probes lists the "
                                "protocols"};
}

}  // namespace

Expected<Recognition, SetupError> recognise(const std::string& address, bool allow_remote) {
  const auto uri = Uri::parse(address);
  if (!uri) return Unexpected<SetupError>(uri.error());
  const bool serial = uri->scheme == "serial";
  if (!serial && uri->scheme != "tcp" && uri->scheme != "udp") {
    return bad_input(
        "\"" + address +
        "\": only devices at serial:, tcp: and udp: can be recognised; add the protocol "
        "and its options (merkel probes lists them)");
  }
  std::string received;
  std::string to_change;
  bool boots = false;
  std::optional<SetupError> unopened;
  Recognition found{.address = address, .baud = 0};
  // Listen first: many devices send without a request.
  for (const int baud :
       serial ? std::span<const int>(kBauds) : std::span<const int>(kBauds).first(1)) {
    auto port = open_port(*uri, baud, false, allow_remote);
    if (!port) {
      // A sensor of another machine cannot be listened at: it is asked below.
      unopened = port.error();
      if (uri->scheme == "udp") break;
      return Unexpected<SetupError>(*unopened);
    }
    const OpeningBytes heard = listen(**port);
    if (heard.bytes.empty()) break;  // silent at every rate
    boots = boots || heard.silence > kAtOnce;
    found.readings = readings_of(heard, uri->scheme);
    const bool text = is_text(text_of(heard.bytes));
    if (received.empty() || text) {
      received = shown(heard.bytes);
      to_change = unreadable(text_of(heard.bytes));
    }
    if (found.readings.empty() && text && !lines_of(heard.bytes).empty()) break;  // the right rate
    if (found.readings.empty()) continue;
    found.baud = serial ? baud : 0;
    found.received = shown(heard.bytes);
    return found;
  }
  const auto try_to_ask = [&](const ProtocolEntry& entry) {
    auto port = open_port(*uri, entry.baud, entry.datagrams, allow_remote);
    if (!port) return false;
    auto reading = request_reading(**port, entry, boots, found.received);
    if (!reading) return false;
    found.baud = serial ? entry.baud : 0;
    found.readings = {std::move(*reading)};
    return true;
  };
  if (uri->scheme == "udp") {
    if (try_to_ask(ati_rdt_entry())) return found;
    return Unexpected<SetupError>(unopened ? *unopened
                                           : nothing_made(address, received, to_change));
  }
  for (const ProtocolEntry& entry : protocol_table()) {
    if (entry.name != "csv" && is_carried(entry, uri->scheme) && try_to_ask(entry)) return found;
  }
  return Unexpected<SetupError>(nothing_made(address, received, to_change));
}

}  // namespace merkel
