#include <charconv>
#include <string>
#include <string_view>

#include "core/printed.hpp"
#include "core/units.hpp"
#include "drivers/protocols/device_units.hpp"
#include "drivers/protocols/number_with_unit.hpp"
#include "drivers/protocols/polled_protocol.hpp"
#include "drivers/protocols/protocol_makers.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr milliseconds kMark10Quiet{1000};  ///< a gauge that is silent this long is restarted
constexpr milliseconds kMark10Patience{200};
constexpr int kRateOfAout1 = 50;  ///< AOUT1 streams 50 readings per second

/// Reads travel and force in any order, distinguished by their units.
bool parse_line(std::string_view line, double plain_factor, DeviceReading& reading,
                std::string& error_message) {
  std::string_view rest = line;
  while (!rest.empty()) {
    const auto number = take_number_with_unit(rest);
    if (!number) return false;
    if (number->unit.empty()) {
      if (plain_factor == 0.0) return false;
      reading.set(DeviceChannel::kForce, number->value * plain_factor);
    } else if (const auto force = factor_to(Quantity::kForce, number->unit)) {
      reading.set(DeviceChannel::kForce, number->value * *force);
    } else if (const auto length = factor_to(Quantity::kLength, number->unit)) {
      reading.set(DeviceChannel::kDepth, number->value * *length);
    } else {
      error_message = "it measures in the unknown unit \"" + std::string(number->unit) +
                      "\": set it to one of " + std::string(kForceUnits);
      return false;
    }
  }
  return reading.channels != 0U;
}

/// The errors that Mark-10's user's guides list.
std::string_view meaning_of_error(std::string_view code) {
  if (code == "*10") return "illegal command";
  if (code == "*11") return "not applicable: this model or its present mode lacks the command";
  if (code == "*12") return "invalid specifier: a part of the command is wrong";
  if (code == "*22") return "value too large: set rate_hz to a rate that this model streams";
  return "an error that its manual does not list";
}

class Mark10 final : public LineProtocol {
 public:
  Mark10(int rate_Hz, double plain_factor) : rate_Hz_(rate_Hz), plain_factor_(plain_factor) {}

  void begin(nanoseconds now, DeviceStream& stream) override {
    lines_.reset(false);
    stream.send("\r");  // ends a partial command on the gauge's side
    request_stream(now, stream);
  }
  void end(DeviceStream& stream) override { stream.send("AOUT0\r"); }

  void read_line(std::string_view line, nanoseconds arrival, DeviceStream& stream) override {
    if (line.front() == '*') {
      ++stream.counts.frames;
      stream.notice("the gauge reports " + std::string(line) + ": " +
                    std::string(meaning_of_error(line)));
      return;
    }
    DeviceReading reading;
    reading.arrival = heard_ = arrival;
    if (!parse_line(line, plain_factor_, reading, error_message_) ||
        reading.channels != bit_of(DeviceChannel::kForce)) {
      ++stream.counts.damaged;
      return;
    }
    error_message_.clear();
    ++stream.counts.frames;
    stream.accept(reading);
  }

  std::optional<nanoseconds> poll(nanoseconds now, DeviceStream& stream) override {
    if (now - heard_ > kMark10Quiet && now - requested_ > kMark10Quiet) request_stream(now, stream);
    return std::max(heard_, requested_) + kMark10Quiet + milliseconds{1};
  }

  [[nodiscard]] std::string expected(std::string_view /*answer*/) const override {
    return "a force with its unit, such as \"1.250 N\"";
  }
  [[nodiscard]] std::uint32_t channels() const noexcept override {
    return bit_of(DeviceChannel::kForce);
  }
  [[nodiscard]] const std::string& error_message() const noexcept override {
    return error_message_;
  }
  [[nodiscard]] std::optional<nanoseconds> period() const noexcept override {
    return period_of(rate_Hz_);
  }

 private:
  void request_stream(nanoseconds now, DeviceStream& stream) {
    requested_ = now;
    if (plain_factor_ == 0.0) stream.send("FULL\r");
    stream.send("AOUT" + std::to_string(rate_Hz_) + "\r");
  }

  int rate_Hz_;
  double plain_factor_;  ///< N of a number without unit; 0: not allowed
  std::string error_message_;
  nanoseconds heard_{0};
  nanoseconds requested_{0};
};

class EsmStand final : public PolledProtocol {
 public:
  explicit EsmStand(double rate_Hz) : PolledProtocol(rate_Hz, kMark10Patience, "n") {}

  void begin(nanoseconds now, DeviceStream& stream) override {
    begin_requests(now, "i", stream);  // millimetres
  }

  void read_line(std::string_view line, nanoseconds arrival, DeviceStream& stream) override {
    DeviceReading reading;
    reading.arrival = arrival;
    if (!parse_line(line, 0.0, reading, error_message_) || !reading.has(DeviceChannel::kDepth)) {
      ++stream.counts.damaged;
      return;
    }
    error_message_.clear();
    ++stream.counts.frames;
    if (!take_answer(reading, stream)) return;
    if (channels_ == 0U) channels_ = reading.channels;
    if (reading.channels != channels_) {
      ++stream.counts.damaged;
      return;
    }
    stream.accept(reading);
  }

  [[nodiscard]] std::string expected(std::string_view /*answer*/) const override {
    return "travel and force with their units, such as \"1.250 mm 0.300 N\"";
  }
  [[nodiscard]] std::uint32_t channels() const noexcept override { return channels_; }
  [[nodiscard]] const std::string& error_message() const noexcept override {
    return error_message_;
  }

 private:
  std::uint32_t channels_ = 0;
  std::string error_message_;
};

class Mark10Device final : public SimulatedDevice {
 public:
  void boot(nanoseconds /*now*/, Bytes& /*out*/) override {
    lines_.reset(true);
    rate_Hz_ = 0;
  }
  void take(std::span<const std::uint8_t> bytes, nanoseconds /*now*/, Bytes& out) override {
    for (const std::uint8_t byte : bytes) {
      const auto line = lines_.take(byte);
      if (!line) continue;
      if (line->starts_with("AOUT")) {
        int rate = 0;
        const auto digits = line->substr(4);
        std::from_chars(digits.data(), digits.data() + digits.size(), rate);
        rate_Hz_ = rate == 1 ? kRateOfAout1 : rate;
      } else if (*line == "?" || *line == "?C") {
        append(reading_, out);
      } else if (*line != "FULL") {
        append("*10\r\n", out);
      }
    }
  }
  void measure(const ProbeSample& sample, std::span<const double> /*others*/, nanoseconds /*now*/,
               Bytes& out) override {
    reading_ = printed("%.4f N\r\n", units::N_from_mN(sample.force_mN));
    if (rate_Hz_ > 0) append(reading_, out);
  }
  [[nodiscard]] bool started() const noexcept override { return rate_Hz_ > 0; }
  [[nodiscard]] std::optional<nanoseconds> period() const noexcept override {
    return period_of(static_cast<double>(rate_Hz_));
  }

 private:
  std::string reading_ = "0.000 N\r\n";
  int rate_Hz_ = 0;  ///< of its stream; 0: not streaming
  LineSplitter lines_;
};

class EsmDevice final : public PolledDevice {
 public:
  explicit EsmDevice(std::uint32_t channels) : force_((channels & ProbeSample::kForce) != 0U) {}

  void take(std::span<const std::uint8_t> bytes, nanoseconds /*now*/, Bytes& out) override {
    for (const std::uint8_t byte : bytes) {
      if (byte != 'n' && byte != 'x') continue;
      requested_ = true;
      append(travel_ + (force_ && byte == 'n' ? " " + load_ : "") + "\r\n", out);
    }
  }
  void measure(const ProbeSample& sample, std::span<const double> /*others*/, nanoseconds /*now*/,
               Bytes& /*out*/) override {
    travel_ = printed("%.3f mm", sample.depth_mm);
    load_ = printed("%.4f N", units::N_from_mN(sample.force_mN));
  }

 private:
  bool force_;
  std::string travel_ = "0.000 mm";
  std::string load_ = "0.000 N";
};

}  // namespace

Expected<std::unique_ptr<Protocol>, SetupError> make_mark10(UriOptions& options) {
  const std::string rate = options.word("rate_hz", "250", "2|5|10|25|50|125|250");
  const std::string unit = options.text("unit", "");
  const auto factor = factor_to(Quantity::kForce, unit);
  if (!unit.empty() && !factor) {
    return bad_input("unit=" + unit + " is unknown: forces are in " + std::string(kForceUnits));
  }
  return std::make_unique<Mark10>(std::stoi(rate), factor.value_or(0.0));
}

std::unique_ptr<SimulatedDevice> make_mark10_device() { return std::make_unique<Mark10Device>(); }

Expected<std::unique_ptr<Protocol>, SetupError> make_esm(UriOptions& options) {
  return std::make_unique<EsmStand>(options.number("rate_hz", 25.0, 1.0, 50.0));
}

std::unique_ptr<SimulatedDevice> make_esm_device(std::uint32_t channels) {
  return std::make_unique<EsmDevice>(channels);
}

}  // namespace merkel
