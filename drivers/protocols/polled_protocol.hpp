#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <utility>

#include "core/units.hpp"
#include "drivers/protocols/line_protocol.hpp"
#include "drivers/protocols/simulated_device.hpp"

namespace merkel {

/// Base of protocols in which the device only answers: one request at a time, at a steady rate,
/// repeated if no answer comes.
class PolledProtocol : public LineProtocol {
 public:
  std::optional<std::chrono::nanoseconds> poll(std::chrono::nanoseconds now,
                                               DeviceStream& stream) final {
    if (now >= next()) {
      stream.send(request_);
      if (requested_) ++stream.counts.lost;
      requested_ = now;
      due_ = due_ + period_ > now ? due_ + period_ : now + period_;
    }
    return next();
  }
  [[nodiscard]] std::optional<std::chrono::nanoseconds> period() const noexcept final {
    return period_;
  }

 protected:
  PolledProtocol(double rate_Hz, std::chrono::milliseconds patience, std::string request)
      : period_(units::nanoseconds_from_s(1.0 / rate_Hz)),
        patience_(patience),
        request_(std::move(request)) {}

  /// Sends `greeting`, then requests, the first of them now.
  void begin_requests(std::chrono::nanoseconds now, std::string_view greeting,
                      DeviceStream& stream) {
    lines_.reset(true);
    due_ = now;
    requested_.reset();
    stream.send(greeting);
  }
  /// The request is answered without a reading.
  void answered() noexcept { requested_.reset(); }
  /// Takes an answer. Returns false, and counts it, if no request was open.
  bool take_answer(DeviceReading& reading, DeviceStream& stream) {
    reading.requested = std::exchange(requested_, std::nullopt);
    if (!reading.requested) ++stream.counts.duplicates;
    return reading.requested.has_value();
  }

 private:
  [[nodiscard]] std::chrono::nanoseconds next() const noexcept {
    return requested_ ? *requested_ + patience_ : due_;
  }

  std::chrono::nanoseconds period_;
  std::chrono::nanoseconds patience_;
  std::string request_;
  std::chrono::nanoseconds due_{0};
  std::optional<std::chrono::nanoseconds> requested_;
};

/// A simulated device that only answers. Its position is available at any time.
class PolledDevice : public SimulatedDevice {
 public:
  [[nodiscard]] bool started() const noexcept final { return requested_; }
  [[nodiscard]] std::optional<std::chrono::nanoseconds> period() const noexcept final {
    return std::chrono::milliseconds{1};
  }

 protected:
  bool requested_ = false;
};

}  // namespace merkel
