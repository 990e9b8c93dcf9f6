#include <algorithm>
#include <array>
#include <optional>
#include <string>

#include "drivers/protocols/clock_order.hpp"
#include "drivers/protocols/hbf1_frame.hpp"
#include "drivers/protocols/hbf1_hello.hpp"
#include "drivers/protocols/hbf1_sync.hpp"
#include "drivers/protocols/protocol_makers.hpp"
#include "drivers/protocols/sequence_counter.hpp"

namespace merkel {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr nanoseconds kClockWrap = microseconds{std::int64_t{1} << 32U};
constexpr milliseconds kRequestAgain{250};
constexpr milliseconds kHbf1Quiet{
    500};  ///< a started device that is silent this long is started again
constexpr milliseconds kSyncPatience{150};
constexpr int kRestart = 3;  ///< frames that confirm a restart
constexpr nanoseconds kBehind = std::chrono::seconds{2};
constexpr nanoseconds kMaxDelay = std::chrono::seconds{60};  ///< longest delay of a frame

constexpr std::array<std::string_view, 4> kStatusWords = {
    "overload", "a saturated channel", "a missing calibration", "a buffer overflow"};
constexpr unsigned kOverloadOrSaturated = 3;  ///< bits of the status

class Hbf1Protocol final : public Protocol {
 public:
  explicit Hbf1Protocol(std::uint16_t rate_Hz) : requested_rate_Hz_(rate_Hz) {}

  void begin(nanoseconds now, DeviceStream& stream) override {
    decoder_.reset(true);
    said_hello_ = false;
    hello_ = {};
    reopened_ = true;
    sequence_.reopened();
    clock_.forget();
    sync_.begin(now);
    ask_at_ = now;
    stream.outgoing.push_back(0);  // ends a partial frame on the device's side
    static_cast<void>(poll(now, stream));
  }

  void start(nanoseconds now, DeviceStream& stream) override {
    wanted_ = true;
    send_start(now, stream);
  }

  void end(DeviceStream& stream) override { command(Hbf1Command::kStop, {}, stream); }

  void take(std::span<const std::uint8_t> bytes, nanoseconds arrival,
            DeviceStream& stream) override {
    stream.counts.bytes += bytes.size();
    const auto damaged = [this] { return decoder_.counts().damaged + malformed_; };
    const std::uint64_t damaged_before = damaged();
    const std::uint64_t frames_before = decoder_.counts().frames;
    for (const std::uint8_t byte : bytes) {
      if (const auto frame = decoder_.take(byte)) read_frame(*frame, arrival, stream);
    }
    stream.counts.frames += decoder_.counts().frames - frames_before;
    stream.counts.damaged += damaged() - damaged_before;
  }

  std::optional<nanoseconds> poll(nanoseconds now, DeviceStream& stream) override {
    if (!said_hello_) {
      if (now >= ask_at_) {
        command(Hbf1Command::kHello, {}, stream);
        ask_at_ = now + kRequestAgain;
      }
      return ask_at_;
    }
    if (now >= sync_.due()) send(Hbf1Type::kSyncRequest, sync_.request(now), stream);
    if (wanted_ && now - heard_ > kHbf1Quiet && now - started_ > kHbf1Quiet)
      send_start(now, stream);
    return sync_.due();
  }

  [[nodiscard]] std::string expected(std::string_view /*answer*/) const override {
    return "frames of version 1 of HBF1, each ended by a zero byte";
  }
  [[nodiscard]] std::uint32_t channels() const noexcept override {
    return layout_ ? layout_->channels() : 0U;
  }
  [[nodiscard]] std::vector<ChannelName> channel_names() const override {
    return layout_ ? layout_->names() : std::vector<ChannelName>{};
  }
  [[nodiscard]] bool ready() const noexcept override {
    // SYNC sets the time before the first sample; old firmware may not answer.
    return layout_ && said_hello_ && (sync_.answered() || heard_ - hello_arrival_ > kSyncPatience);
  }
  [[nodiscard]] bool describes_itself() const noexcept override { return true; }
  [[nodiscard]] const std::string& error_message() const noexcept override {
    return error_message_;
  }
  [[nodiscard]] std::optional<nanoseconds> period() const noexcept override {
    if (!layout_) return std::nullopt;
    return period_of(requested_rate_Hz_ != 0 ? requested_rate_Hz_ : layout_->rate_Hz());
  }
  [[nodiscard]] std::optional<nanoseconds> clock_wrap() const noexcept override {
    return kClockWrap;
  }
  [[nodiscard]] std::string serial_number() const override {
    return layout_ ? layout_->serial_number() : "";
  }

 private:
  void send(Hbf1Type type, std::span<const std::uint8_t> body, DeviceStream& stream) {
    append_hbf1_frame({.type = type, .sequence = next_sequence_++}, body, stream.outgoing);
  }

  void command(Hbf1Command operation, std::span<const std::uint8_t> arguments,
               DeviceStream& stream) {
    Bytes body = {static_cast<std::uint8_t>(operation)};
    body.insert(body.end(), arguments.begin(), arguments.end());
    send(Hbf1Type::kCommand, body, stream);
  }

  void send_start(nanoseconds now, DeviceStream& stream) {
    started_ = now;
    if (requested_rate_Hz_ != 0) {
      Bytes rate;
      append_u16(requested_rate_Hz_, rate);
      command(Hbf1Command::kRate, rate, stream);
    }
    command(Hbf1Command::kStart, {}, stream);
  }

  /// True if a frame belongs to the same run of the device as the previous one: the device's clock
  /// cannot get ahead of the host's, and while the port was closed it advanced at the host's rate.
  [[nodiscard]] bool continues(std::uint32_t time_us, nanoseconds arrival) const noexcept {
    const auto host = arrival - last_arrival_;
    const nanoseconds device = microseconds{time_us - last_time_us_};
    // A sample has the time of its latch, which may precede the time of an earlier answer.
    if (kClockWrap - device < kBehind) return true;
    if (!reopened_) return device <= host + kMaxDelay;
    const nanoseconds ahead = (device - host % kClockWrap + kClockWrap) % kClockWrap;
    return ahead < kBehind || kClockWrap - ahead < kBehind;
  }

  /// Tracks sequence numbers and restarts. False for a repeated frame or a late sample.
  bool follow(const Hbf1Header& header, nanoseconds arrival, DeviceStream& stream) {
    const bool continued = last_arrival_ == nanoseconds{0} || continues(header.time_us, arrival);
    const bool hello = header.type == Hbf1Type::kHello;
    const bool in_order =
        !reopened_ && header.sequence == static_cast<std::uint16_t>(last_sequence_ + 1U);
    in_order_ = in_order ? in_order_ + 1 : 0;
    // Numbers that go on with impossible times are wrong times; ReadingTimes handles them.
    const bool clock_restarted =
        clock_.restarted(microseconds{header.time_us}, arrival, kClockWrap) && in_order_ < kRestart;
    if (clock_restarted || (!continued && !in_order && (reopened_ || hello))) {
      if (!reopened_) pending_reboot_ = true;
      sequence_.forget();
      clock_.forget();
      last_time_us_ = header.time_us;
      last_arrival_ = arrival;
    } else if (continued) {
      last_time_us_ = header.time_us;
      last_arrival_ = arrival;
    }
    reopened_ = false;
    last_sequence_ = header.sequence;
    heard_ = arrival;
    const auto step = sequence_.next(header.sequence, stream);
    pending_lost_ += step.lost;
    if (step.restarted) pending_reboot_ = true;
    return !step.duplicate && !(step.late && header.type == Hbf1Type::kSample);
  }

  void read_frame(const Hbf1Frame& frame, nanoseconds arrival, DeviceStream& stream) {
    if (frame.header.type >= Hbf1Type::kCommand) {
      // The host's own frame: the line echoes. Not a frame of the device.
      if (!echo_noticed_) stream.notice("the device echoes the host's bytes: switch off its echo");
      echo_noticed_ = true;
      return;
    }
    if (!follow(frame.header, arrival, stream)) return;
    switch (frame.header.type) {
      case Hbf1Type::kHello:
        if (!read_hello(frame.body, arrival, stream)) ++malformed_;
        break;
      case Hbf1Type::kSample:
        read_sample(frame, arrival, stream);
        break;
      case Hbf1Type::kEvent:
        if (frame.body.size() != 6) {
          ++malformed_;
          break;
        }
        read_event(frame, arrival, stream);
        break;
      case Hbf1Type::kText:
        stream.notice("message of the device: " + hbf1_text(frame.body));
        break;
      case Hbf1Type::kSyncResponse:
        if (!read_sync(frame, arrival, stream)) ++malformed_;
        break;
      case Hbf1Type::kAcknowledge:
        if (frame.body.size() != 2) {
          ++malformed_;
        } else if (frame.body[1] != 0) {
          stream.notice("the device refused command " + std::to_string(frame.body[0]) +
                        " with status " + std::to_string(frame.body[1]));
        }
        break;
      default:
        ++malformed_;
    }
  }

  void read_event(const Hbf1Frame& frame, nanoseconds arrival, DeviceStream& stream) const {
    constexpr unsigned kLevelBit = 16;
    const std::uint16_t code = read_u16(frame.body.first<2>());
    const std::uint32_t argument = read_u32(frame.body.subspan<2, 4>());
    const auto line = static_cast<std::uint16_t>(argument);
    if (code != kHbf1Edge || line == 0 || argument >> kLevelBit > 1U) {
      stream.notice("the device reports event " + std::to_string(code) + " with " +
                    std::to_string(argument));
      return;
    }
    // After a restart, its clock is known again from the next sample on.
    if (pending_reboot_) return;
    stream.edges.push_back({.line = line,
                            .high = argument >> kLevelBit == 1U,
                            .device_time = microseconds{frame.header.time_us},
                            .arrival = arrival});
  }

  bool read_hello(std::span<const std::uint8_t> body, nanoseconds arrival, DeviceStream& stream) {
    const auto whole = hello_.take(body);
    if (!whole) {
      if (!whole.error().sentence.empty()) error_message_ = whole.error().sentence;
      return false;
    }
    if (!*whole) return true;
    hello_.number(names_);
    const bool known = layout_.has_value();
    layout_ = std::exchange(hello_, {});
    stream.columns_changed = stream.columns_changed || known;
    if (!said_hello_) hello_arrival_ = arrival;
    said_hello_ = true;
    if (wanted_) send_start(arrival, stream);  // it sends again after a restart
    return true;
  }

  void read_sample(const Hbf1Frame& frame, nanoseconds arrival, DeviceStream& stream) {
    if (!layout_) return;
    if (frame.body.size() != kHbf1StatusBytes + layout_->sample_bytes()) {
      ++malformed_;
      return;
    }
    const std::uint16_t status = read_u16(frame.body.first<2>());
    for (std::size_t bit = 0; bit < kStatusWords.size(); ++bit) {
      const unsigned mask = 1U << bit;
      if ((status & mask) != 0U && (status_ & mask) == 0U) {
        stream.notice("the device reports " + std::string(kStatusWords[bit]));
      }
    }
    status_ = status;
    DeviceReading reading;
    reading.arrival = arrival;
    reading.device_time = microseconds{frame.header.time_us};
    reading.lost = std::exchange(pending_lost_, 0U);
    reading.rebooted = std::exchange(pending_reboot_, false);
    reading.saturated = (status & kOverloadOrSaturated) != 0U;
    layout_->read_values(frame.body.subspan(kHbf1StatusBytes), reading);
    stream.accept(reading);
  }

  bool read_sync(const Hbf1Frame& frame, nanoseconds arrival, DeviceStream& stream) {
    if (frame.body.size() != 8) return false;
    if (const auto exchange = sync_.answer(frame, arrival)) stream.exchanges.push_back(*exchange);
    return true;
  }

  std::uint16_t requested_rate_Hz_;
  Hbf1Decoder decoder_;
  SequenceCounter sequence_{16};
  ClockOrder clock_{kBehind};
  int in_order_ = 0;                 ///< frames since the last one out of order
  Hbf1Hello hello_;                  ///< the one that is arriving
  std::optional<Hbf1Hello> layout_;  ///< of the last whole HELLO
  std::vector<std::string> names_;   ///< of its channels, and of those of earlier ones
  std::uint16_t status_ = 0;
  std::string error_message_;
  std::uint64_t malformed_ = 0;  ///< invalid frames that pass their CRC
  bool said_hello_ = false;
  bool wanted_ = false;
  bool reopened_ = true;
  bool echo_noticed_ = false;
  bool pending_reboot_ = false;
  std::uint32_t pending_lost_ = 0;
  std::uint16_t last_sequence_ = 0;
  std::uint32_t last_time_us_ = 0;
  nanoseconds last_arrival_{0};
  nanoseconds heard_{0};
  nanoseconds hello_arrival_{0};
  nanoseconds started_{0};
  nanoseconds ask_at_{0};
  Hbf1Sync sync_;
  std::uint16_t next_sequence_ = 0;
};

}  // namespace

Expected<std::unique_ptr<Protocol>, SetupError> make_hbf1(UriOptions& options) {
  const auto rate_Hz = options.whole("rate_hz", 0, 1, 20'000);
  return std::make_unique<Hbf1Protocol>(static_cast<std::uint16_t>(rate_Hz));
}

}  // namespace merkel
