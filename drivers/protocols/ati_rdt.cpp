#include <algorithm>
#include <array>
#include <cmath>

#include "core/printed.hpp"
#include "core/units.hpp"
#include "drivers/protocols/protocol_makers.hpp"
#include "drivers/protocols/sequence_counter.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr std::uint16_t kRdtHeader = 0x1234;
constexpr std::uint16_t kStop = 0;
constexpr std::uint16_t kStream = 2;
constexpr std::size_t kRequestBytes = 8;
/// Status bits of a reading beyond the sensor's range: 17 of a Net Box (transducer saturation); 27
/// and 30 of an Axia (gage, force or torque out of range).
constexpr std::uint32_t kOverRange = 1U << 17U | 1U << 27U | 1U << 30U;
constexpr milliseconds kRdtQuiet{500};  ///< a request is one datagram, which may be lost
constexpr double kUsualCounts_per_N = 1e6;

std::uint32_t read_u32_be(std::span<const std::uint8_t> bytes, std::size_t at) noexcept {
  return static_cast<std::uint32_t>(bytes[at]) << 24U |
         static_cast<std::uint32_t>(bytes[at + 1]) << 16U |
         static_cast<std::uint32_t>(bytes[at + 2]) << 8U | bytes[at + 3];
}

void append_be(std::uint64_t number, int bytes, Bytes& out) {
  for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8) {
    out.push_back(static_cast<std::uint8_t>(number >> shift));
  }
}

class AtiRdt final : public Protocol {
 public:
  AtiRdt(double counts_per_N, double rate_Hz) : counts_per_N_(counts_per_N), rate_Hz_(rate_Hz) {}

  void begin(nanoseconds now, DeviceStream& stream) override {
    length_ = 0;
    sequence_.reopened();
    request(kStream, now, stream);
  }
  void end(DeviceStream& stream) override { request(kStop, requested_, stream); }

  void take(std::span<const std::uint8_t> bytes, nanoseconds arrival,
            DeviceStream& stream) override {
    stream.counts.bytes += bytes.size();
    for (const std::uint8_t byte : bytes) {
      record_[length_++] = byte;
      if (length_ < kAtiRecordBytes) continue;
      length_ = 0;
      read_record(arrival, stream);
    }
  }

  std::optional<nanoseconds> poll(nanoseconds now, DeviceStream& stream) override {
    if (now - heard_ > kRdtQuiet && now - requested_ > kRdtQuiet) request(kStream, now, stream);
    return std::max(heard_, requested_) + kRdtQuiet + milliseconds{1};
  }

  [[nodiscard]] std::string expected(std::string_view /*answer*/) const override {
    return "records of 36 bytes";
  }
  [[nodiscard]] std::uint32_t channels() const noexcept override {
    return bit_of(DeviceChannel::kForceX) | bit_of(DeviceChannel::kForceY) |
           bit_of(DeviceChannel::kForceZ);
  }
  [[nodiscard]] std::optional<nanoseconds> period() const noexcept override {
    return period_of(rate_Hz_);
  }
  [[nodiscard]] std::optional<nanoseconds> clock_wrap() const noexcept override {
    if (rate_Hz_ == 0.0) return std::nullopt;
    return units::nanoseconds_from_s(4294967296.0 / rate_Hz_);
  }

 private:
  void request(std::uint16_t command, nanoseconds now, DeviceStream& stream) {
    requested_ = now;
    append_be(kRdtHeader, 2, stream.outgoing);
    append_be(command, 2, stream.outgoing);
    append_be(0, 4, stream.outgoing);  // until a stop request
  }

  void read_record(nanoseconds arrival, DeviceStream& stream) {
    ++stream.counts.frames;
    heard_ = arrival;
    const std::uint32_t number = read_u32_be(record_, 0);
    const std::uint32_t status = read_u32_be(record_, 8);
    const auto step = sequence_.next(number, stream);
    if (step.dropped()) return;
    if (status != status_ && status != 0) {
      stream.notice(
          printed("the Net F/T reports status 0x%08X: %s", status,
                  (status & kOverRange) != 0U
                      ? "a gage, force or torque is out of range, so its readings are wrong"
                      : "see its web page"));
    }
    status_ = status;
    DeviceReading reading;
    reading.arrival = arrival;
    reading.lost = step.lost;
    reading.rebooted = step.restarted;
    reading.saturated = (status & kOverRange) != 0U;
    if (rate_Hz_ != 0.0) reading.device_time = units::nanoseconds_from_s(number / rate_Hz_);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto counts = static_cast<std::int32_t>(read_u32_be(record_, 12 + 4 * axis));
      reading.saturated = reading.saturated || counts == INT32_MAX || counts == INT32_MIN;
      const auto first = static_cast<std::size_t>(DeviceChannel::kForceX);
      reading.set(static_cast<DeviceChannel>(first + axis), counts / counts_per_N_);
    }
    stream.accept(reading);
  }

  double counts_per_N_;
  double rate_Hz_;  ///< 0: unknown
  SequenceCounter sequence_{32};
  std::array<std::uint8_t, kAtiRecordBytes> record_{};
  std::size_t length_ = 0;
  std::uint32_t status_ = 0;
  nanoseconds heard_{0};
  nanoseconds requested_{0};
};

class AtiRdtDevice final : public SimulatedDevice {
 public:
  void boot(nanoseconds /*now*/, Bytes& /*out*/) override {
    streaming_ = false;
    sequence_ = 0;
    request_.clear();
  }
  void take(std::span<const std::uint8_t> bytes, nanoseconds /*now*/, Bytes& /*out*/) override {
    for (const std::uint8_t byte : bytes) {
      request_.push_back(byte);
      if (request_.size() < kRequestBytes) continue;
      const std::uint32_t head = read_u32_be(request_, 0);
      if (head >> 16U == kRdtHeader) {
        streaming_ = (head & 0xFFFFU) == kStream;
        remaining_ = read_u32_be(request_, 4);
      }
      request_.clear();
    }
  }
  void measure(const ProbeSample& sample, std::span<const double> /*others*/, nanoseconds /*now*/,
               Bytes& out) override {
    if (!streaming_) return;
    const double force_N = units::N_from_mN(sample.force_mN);
    const auto counts = static_cast<std::int32_t>(
        std::clamp(std::round(force_N * kUsualCounts_per_N), -2147483648.0, 2147483647.0));
    append_be(++sequence_, 4, out);
    append_be(sequence_, 4, out);
    append_be(0, 4, out);
    for (const std::int32_t value : {0, 0, counts, 0, 0, 0}) {
      append_be(static_cast<std::uint32_t>(value), 4, out);
    }
    if (remaining_ > 0 && --remaining_ == 0) streaming_ = false;
  }
  [[nodiscard]] bool started() const noexcept override { return streaming_; }

 private:
  Bytes request_;
  bool streaming_ = false;
  std::uint32_t remaining_ = 0;  ///< of the requested records; 0: until a stop request
  std::uint32_t sequence_ = 0;
};

}  // namespace

Expected<std::unique_ptr<Protocol>, SetupError> make_ati_rdt(UriOptions& options) {
  const double counts = options.number("counts_per_N", kUsualCounts_per_N, 1e-3, 1e12);
  const double rate_Hz = options.number("rate_hz", 0.0, 0.1, 20'000.0);
  return std::make_unique<AtiRdt>(counts, rate_Hz);
}

std::unique_ptr<SimulatedDevice> make_ati_rdt_device(std::uint32_t /*channels*/) {
  return std::make_unique<AtiRdtDevice>();
}

}  // namespace merkel
