#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string>
#include <string_view>

#include "core/units.hpp"
#include "drivers/protocols/protocol_makers.hpp"
#include "drivers/protocols/sequence_counter.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr std::array<std::uint8_t, 4> kOptoForceHeader = {0xAA, 0x07, 0x08, 0x0A};
constexpr std::size_t kFrameBytes = 16;
constexpr std::size_t kConfigBytes = 9;
constexpr milliseconds kOptoForceQuiet{500};
constexpr double kSimulatedCounts_per_N = 1024.0;

/// The speeds of the DAQ's manual: Hz, and the code, which is the period in ms.
struct Speed {
  int rate_Hz;
  std::uint8_t code;
};
constexpr std::array<Speed, 5> kSpeeds = {{{1000, 1}, {333, 3}, {100, 10}, {30, 33}, {10, 100}}};

/// The zeroing byte of a configuration. Its manual defines 0 (removes the zero that was set) and
/// 255 (the present load is the new zero). Every configuration has the byte, so one that is neither
/// keeps the zero of the sensor.
constexpr std::uint8_t kZeroCleared = 0;
constexpr std::uint8_t kZeroKept = 1;
constexpr std::uint8_t kZeroSet = 255;

// The status word, by the DAQ's manual.
constexpr std::uint16_t kOverloads = 0x03F0;  ///< bits 9 to 4: Fx, Fy, Fz, Tx, Ty, Tz

/// The errors of a status word; empty if it reports overloads only.
std::string errors_of(std::uint16_t status) {
  std::string errors;
  const auto add = [&errors](std::string_view error) {
    errors += errors.empty() ? "" : ", ";
    errors += error;
  };
  const unsigned daq = status >> 13U & 7U;
  if (daq != 0U) add(daq == 1U ? "DAQ error" : daq == 2U ? "communication error" : "unknown error");
  const unsigned sensor = status >> 10U & 7U;
  if (sensor != 0U) {
    add(sensor == 1U   ? "sensor not detected"
        : sensor == 2U ? "sensor failure"
        : sensor == 4U ? "temperature error"
                       : "unknown error of the sensor");
  }
  return errors;
}

std::uint16_t sum_of(std::span<const std::uint8_t> bytes) noexcept {
  return static_cast<std::uint16_t>(std::accumulate(bytes.begin(), bytes.end(), 0U));
}

/// Reads a big-endian number.
std::uint16_t read_u16(std::span<const std::uint8_t> bytes, std::size_t at) noexcept {
  return static_cast<std::uint16_t>(bytes[at] << 8 | bytes[at + 1]);
}

void append_u16(std::uint16_t number, Bytes& out) {
  out.push_back(static_cast<std::uint8_t>(number >> 8U));
  out.push_back(static_cast<std::uint8_t>(number & 0xFFU));
}

class OptoForce final : public Protocol {
 public:
  OptoForce(std::array<double, 3> counts_per_N, Speed speed, std::uint8_t filter,
            std::uint8_t zeroing)
      : counts_per_N_(counts_per_N), speed_(speed), filter_(filter), zeroing_(zeroing) {}

  void begin(nanoseconds now, DeviceStream& stream) override {
    length_ = 0;
    synchronised_ = false;
    configure(now, speed_.code, stream);
    zeroing_ = kZeroKept;  // once, at the first start: later, the probe may be pressed
  }
  void end(DeviceStream& stream) override { configure(requested_, 0, stream); }

  void take(std::span<const std::uint8_t> bytes, nanoseconds arrival,
            DeviceStream& stream) override {
    stream.counts.bytes += bytes.size();
    for (const std::uint8_t byte : bytes) {
      frame_[length_++] = byte;
      drop_what_is_no_header(stream);
      if (length_ < kFrameBytes) continue;
      if (sum_of(std::span(frame_).first(kFrameBytes - 2)) != read_u16(frame_, kFrameBytes - 2)) {
        // The apparent header may have been data: continue at its second byte.
        lose_synchronism(stream);
        drop(1);
        drop_what_is_no_header(stream);
        continue;
      }
      length_ = 0;
      synchronised_ = true;
      read_frame(arrival, stream);
    }
  }

  std::optional<nanoseconds> poll(nanoseconds now, DeviceStream& stream) override {
    if (now - heard_ > kOptoForceQuiet && now - requested_ > kOptoForceQuiet)
      configure(now, speed_.code, stream);
    return std::max(heard_, requested_) + kOptoForceQuiet + milliseconds{1};
  }

  [[nodiscard]] std::string expected(std::string_view /*answer*/) const override {
    return "frames of 16 bytes that begin with AA 07 08 0A";
  }
  [[nodiscard]] std::uint32_t channels() const noexcept override {
    return bit_of(DeviceChannel::kForceX) | bit_of(DeviceChannel::kForceY) |
           bit_of(DeviceChannel::kForceZ);
  }
  [[nodiscard]] std::optional<nanoseconds> period() const noexcept override {
    return period_of(speed_.rate_Hz);
  }

 private:
  void configure(nanoseconds now, std::uint8_t speed, DeviceStream& stream) {
    requested_ = now;
    Bytes config = {0xAA, 0x00, 0x32, 0x03, speed, filter_, zeroing_};
    append_u16(sum_of(config), config);
    stream.outgoing.insert(stream.outgoing.end(), config.begin(), config.end());
  }

  void drop(std::size_t count) noexcept {
    length_ -= count;
    for (std::size_t i = 0; i < length_; ++i) frame_[i] = frame_[i + count];
  }

  /// Drops leading bytes that cannot start a frame.
  void drop_what_is_no_header(DeviceStream& stream) {
    while (length_ > 0 && !std::equal(frame_.begin(),
                                      frame_.begin() + static_cast<std::ptrdiff_t>(std::min(
                                                           length_, kOptoForceHeader.size())),
                                      kOptoForceHeader.begin())) {
      lose_synchronism(stream);
      drop(1);
    }
  }

  /// Counts one damaged frame per stretch of invalid bytes.
  void lose_synchronism(DeviceStream& stream) {
    if (synchronised_) ++stream.counts.damaged;
    synchronised_ = false;
  }

  void read_frame(nanoseconds arrival, DeviceStream& stream) {
    ++stream.counts.frames;
    heard_ = arrival;
    const std::uint16_t status = read_u16(frame_, 6);
    const std::string errors = errors_of(status);
    if (!errors.empty() && errors != errors_) stream.notice("the sensor reports: " + errors);
    errors_ = errors;
    const auto step = sequence_.next(read_u16(frame_, 4), stream);
    if (step.dropped()) return;
    DeviceReading reading;
    reading.arrival = arrival;
    reading.lost = step.lost;
    reading.rebooted = step.restarted;
    reading.saturated = (status & kOverloads) != 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto counts = static_cast<std::int16_t>(read_u16(frame_, 8 + 2 * axis));
      reading.saturated = reading.saturated || counts == INT16_MAX || counts == INT16_MIN;
      const auto first = static_cast<std::size_t>(DeviceChannel::kForceX);
      reading.set(static_cast<DeviceChannel>(first + axis), counts / counts_per_N_[axis]);
    }
    stream.accept(reading);
  }

  std::array<double, 3> counts_per_N_;
  Speed speed_;
  std::uint8_t filter_;
  std::uint8_t zeroing_;  ///< of the next configuration
  SequenceCounter sequence_{16};
  std::array<std::uint8_t, kFrameBytes> frame_{};
  std::size_t length_ = 0;
  bool synchronised_ = false;
  std::string errors_;  ///< as last reported
  nanoseconds heard_{0};
  nanoseconds requested_{0};
};

class OptoForceDevice final : public SimulatedDevice {
 public:
  void boot(nanoseconds /*now*/, Bytes& /*out*/) override {
    speed_ = 0;
    count_ = 0;
    config_.clear();
  }

  void take(std::span<const std::uint8_t> bytes, nanoseconds /*now*/, Bytes& /*out*/) override {
    for (const std::uint8_t byte : bytes) {
      if (config_.empty() && byte != 0xAA) continue;
      config_.push_back(byte);
      if (config_.size() < kConfigBytes) continue;
      if (sum_of(std::span(config_).first(kConfigBytes - 2)) ==
          read_u16(config_, kConfigBytes - 2)) {
        speed_ = config_[4];
      }
      config_.clear();
    }
  }

  void measure(const ProbeSample& sample, std::span<const double> /*others*/, nanoseconds /*now*/,
               Bytes& out) override {
    if (speed_ == 0) return;
    const auto counts = std::clamp(
        std::lround(units::N_from_mN(sample.force_mN) * kSimulatedCounts_per_N), -32768L, 32767L);
    Bytes frame(kOptoForceHeader.begin(), kOptoForceHeader.end());
    for (const long number : {static_cast<long>(count_++), 0L, 0L, 0L, counts}) {
      append_u16(static_cast<std::uint16_t>(number), frame);
    }
    append_u16(sum_of(frame), frame);
    out.insert(out.end(), frame.begin(), frame.end());
  }

  [[nodiscard]] bool started() const noexcept override { return speed_ != 0; }
  [[nodiscard]] std::optional<nanoseconds> period() const noexcept override {
    return speed_ == 0 ? std::nullopt : std::optional<nanoseconds>(milliseconds{speed_});
  }
  [[nodiscard]] std::string uri_options() const override { return "counts_per_N=1024"; }

 private:
  Bytes config_;
  std::uint8_t speed_ = 0;
  std::uint16_t count_ = 0;
};

}  // namespace

Expected<std::unique_ptr<Protocol>, SetupError> make_optoforce(UriOptions& options) {
  constexpr double kMax = 1e6;
  const double all = options.number("counts_per_N", 0.0, 1e-3, kMax);
  const std::array<double, 3> counts = {options.number("counts_per_N_x", all, 1e-3, kMax),
                                        options.number("counts_per_N_y", all, 1e-3, kMax),
                                        options.number("counts_per_N_z", all, 1e-3, kMax)};
  const std::string rate = options.word("rate_hz", "1000", "1000|333|100|30|10");
  const std::string zero = options.word("zero", "keep", "keep|set|clear");
  const auto filter = options.whole("filter", 4, 0, 6);
  if (std::find(counts.begin(), counts.end(), 0.0) != counts.end()) {
    return bad_input(
        "the option counts_per_N is missing: take it from the sensor's calibration sheet");
  }
  const auto* const speed =
      std::find_if(kSpeeds.begin(), kSpeeds.end(),
                   [&rate](const Speed& each) { return std::to_string(each.rate_Hz) == rate; });
  if (speed == kSpeeds.end()) return bad_input("the option rate_hz is wrong");
  const std::uint8_t zeroing = zero == "set"     ? kZeroSet
                               : zero == "clear" ? kZeroCleared
                                                 : kZeroKept;
  return std::make_unique<OptoForce>(counts, *speed, static_cast<std::uint8_t>(filter), zeroing);
}

std::unique_ptr<SimulatedDevice> make_optoforce_device() {
  return std::make_unique<OptoForceDevice>();
}

}  // namespace merkel
