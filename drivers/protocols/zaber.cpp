#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

#include "core/printed.hpp"
#include "core/units.hpp"
#include "drivers/files/csv_text.hpp"
#include "drivers/parsed_number.hpp"
#include "drivers/protocols/polled_protocol.hpp"
#include "drivers/protocols/protocol_makers.hpp"
#include "drivers/take_part.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr milliseconds kZaberPatience{200};
constexpr double kSimulatedSteps_per_mm = 1024.0;

/// Removes an optional checksum ":XX" from a message. False if it is wrong.
bool take_checksum(std::string_view& message) noexcept {
  if (message.size() < 4 || message[message.size() - 3] != ':') return true;
  const auto given = parsed_number<int>(message.substr(message.size() - 2), 16);
  message.remove_suffix(3);
  unsigned sum = 0;
  for (const char c : message.substr(1)) sum += static_cast<unsigned char>(c);
  return given && static_cast<unsigned>(*given) == (0U - sum) % 256U;
}

class Zaber final : public PolledProtocol {
 public:
  Zaber(double mm_per_step, DeviceChannel channel, int address, int axis, double rate_Hz)
      : PolledProtocol(rate_Hz, kZaberPatience,
                       "/" + std::to_string(address) + " " + std::to_string(axis) + " get pos\n"),
        mm_per_step_(mm_per_step),
        channel_(channel),
        address_(address),
        axis_(axis) {}

  void begin(nanoseconds now, DeviceStream& stream) override { begin_requests(now, "\n", stream); }

  void read_line(std::string_view line, nanoseconds arrival, DeviceStream& stream) override {
    std::string_view message = line;
    const bool known =
        (message.front() == '@' || message.front() == '#' || message.front() == '!') &&
        take_checksum(message);
    if (!known || !read_message(message, arrival, stream)) {
      ++stream.counts.damaged;
    } else {
      ++stream.counts.frames;
    }
  }

  [[nodiscard]] std::string expected(std::string_view answer) const override {
    return printed(
        "a reply of address %d and axis %d (stage_axis), such as \"@%02d %d OK IDLE -- "
        "1024\"%s",
        address_, axis_, address_, axis_,
        answer.empty() || take_checksum(answer) ? "" : ", and this one's checksum is wrong");
  }
  [[nodiscard]] std::uint32_t channels() const noexcept override { return bit_of(channel_); }

 private:
  bool read_message(std::string_view message, nanoseconds arrival, DeviceStream& stream) {
    if (message.front() == '#') return true;  // information for users
    std::string_view rest = message.substr(1);
    const auto address = parsed_number<int>(take_part(rest, ' '));
    const auto axis = parsed_number<int>(take_part(rest, ' '));
    if (!address || !axis) return false;
    if (*address != address_) return true;
    if (message.front() == '!') {
      stream.notice("alert of the stage: " + std::string(message));
      return true;
    }
    const std::string_view verdict = take_part(rest, ' ');
    const std::string_view status = take_part(rest, ' ');
    const std::string_view warning = take_part(rest, ' ');
    if ((verdict != "OK" && verdict != "RJ") || (status != "IDLE" && status != "BUSY")) {
      return false;
    }
    if (warning != warning_ && warning != "--") {
      stream.notice("warning of the stage: " + std::string(warning) +
                    (warning.starts_with('F') ? " (fault; see the stage's manual)" : ""));
    }
    warning_ = warning;
    // A device with one axis may answer as a whole, by axis 0: with one number, as its axis does.
    if (*axis != axis_ && (*axis != 0 || (verdict == "OK" && !parse_number(rest)))) return true;
    if (verdict == "RJ") {
      answered();
      ++stream.counts.lost;
      stream.notice("the stage rejected the request for its position: " + std::string(rest));
      return true;
    }
    const auto steps = parse_number(rest);
    if (!steps) return false;
    DeviceReading reading;
    reading.arrival = arrival;
    if (!take_answer(reading, stream)) return true;
    reading.set(channel_, *steps * mm_per_step_);
    stream.accept(reading);
    return true;
  }

  double mm_per_step_;
  DeviceChannel channel_;
  int address_;
  int axis_;
  std::string warning_ = "--";
};

class ZaberDevice final : public PolledDevice {
 public:
  void boot(nanoseconds /*now*/, Bytes& /*out*/) override { lines_.reset(true); }

  void take(std::span<const std::uint8_t> bytes, nanoseconds /*now*/, Bytes& out) override {
    for (const std::uint8_t byte : bytes) {
      const auto line = lines_.take(byte);
      if (!line || *line != "/1 1 get pos") continue;
      requested_ = true;
      const std::string reply = "@01 1 OK IDLE -- " + std::to_string(steps_);
      unsigned sum = 0;
      for (const char c : reply.substr(1)) sum += static_cast<unsigned char>(c);
      append(reply + printed(":%02X\r\n", (0U - sum) % 256U), out);
    }
  }
  void measure(const ProbeSample& sample, std::span<const double> /*others*/, nanoseconds /*now*/,
               Bytes& /*out*/) override {
    steps_ = std::lround(sample.depth_mm * kSimulatedSteps_per_mm);
  }
  [[nodiscard]] std::string uri_options() const override { return "um_per_step=0.9765625"; }

 private:
  long steps_ = 0;
  LineSplitter lines_;
};

}  // namespace

Expected<std::unique_ptr<Protocol>, SetupError> make_zaber(UriOptions& options) {
  const double um_per_step = options.number("um_per_step", 0.0, 1e-6, 1e4);
  const std::string axis = options.word("axis", "depth", "depth|x|y|z");
  const auto address = options.whole("address", 1, 1, 99);
  const auto stage_axis = options.whole("stage_axis", 1, 1, 9);
  const double rate_Hz = options.number("rate_hz", 50.0, 1.0, 200.0);
  if (um_per_step == 0.0) {
    return bad_input(
        "the option um_per_step is missing: take the microstep size from the stage's data sheet");
  }
  const auto channel = std::find(kDeviceChannelNames.begin(), kDeviceChannelNames.end(), axis) -
                       kDeviceChannelNames.begin();
  return std::make_unique<Zaber>(units::mm_from_um(um_per_step),
                                 static_cast<DeviceChannel>(channel), static_cast<int>(address),
                                 static_cast<int>(stage_axis), rate_Hz);
}

std::unique_ptr<SimulatedDevice> make_zaber_device() { return std::make_unique<ZaberDevice>(); }

}  // namespace merkel
