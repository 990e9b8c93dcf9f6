#include "drivers/protocols/analog_scans.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

namespace merkel {
namespace {

using std::chrono::nanoseconds;

class AnalogScans final : public Protocol {
 public:
  explicit AnalogScans(AnalogFormat format)
      : format_(std::move(format)), scan_(format_.columns.size() * format_.sample_bytes) {
    for (const CsvColumn& column : format_.columns) channels_ |= bit_of(column.channel);
  }

  void begin(nanoseconds /*now*/, DeviceStream& /*stream*/) override {
    restarted_ = number_ > 0 || restarted_;
    number_ = 0;
    filled_ = 0;
  }

  void take(std::span<const std::uint8_t> bytes, nanoseconds arrival,
            DeviceStream& stream) override {
    stream.counts.bytes += bytes.size();
    while (!bytes.empty()) {
      const std::size_t count = std::min(bytes.size(), scan_.size() - filled_);
      std::copy_n(bytes.begin(), count, scan_.begin() + static_cast<std::ptrdiff_t>(filled_));
      bytes = bytes.subspan(count);
      filled_ += count;
      if (filled_ == scan_.size()) read_scan(arrival, stream);
    }
  }

  [[nodiscard]] std::string expected(std::string_view /*answer*/) const override {
    return "scans of " + std::to_string(scan_.size()) + " bytes";
  }
  [[nodiscard]] std::uint32_t channels() const noexcept override { return channels_; }
  [[nodiscard]] bool ready() const noexcept override { return true; }
  [[nodiscard]] std::vector<ChannelName> channel_names() const override {
    std::vector<ChannelName> names = names_of_columns(format_.columns);
    for (ChannelName& each : names) {
      // The factors of the columns are those to one volt.
      const auto unit = unit_named(each.name.substr(each.name.rfind('_') + 1));
      if (unit && unit->is_electrical()) each.factor *= unit->factor;
    }
    return names;
  }
  [[nodiscard]] std::optional<nanoseconds> period() const noexcept override {
    return format_.period;
  }

 private:
  void read_scan(nanoseconds arrival, DeviceStream& stream) {
    DeviceReading reading;
    reading.arrival = arrival;
    reading.device_time = static_cast<std::int64_t>(number_++) * format_.period;
    reading.rebooted = std::exchange(restarted_, false);
    filled_ = 0;
    for (std::size_t i = 0; i < format_.columns.size(); ++i) {
      const CsvColumn& column = format_.columns[i];
      if (column.kind != CsvColumn::Kind::kValue) continue;
      const std::uint32_t raw = raw_value(i);
      const AnalogConversion& conversion = format_.conversions[i];
      reading.set(column.channel, conversion.volts(raw) * column.factor);
      if (column.quantity == Quantity::kSync) continue;  // it may well be at an end of the range
      reading.saturated = reading.saturated || raw == 0 || raw >= conversion.largest;
    }
    ++stream.counts.frames;
    stream.accept(reading);
  }

  [[nodiscard]] std::uint32_t raw_value(std::size_t channel) const noexcept {
    const std::uint8_t* const at = scan_.data() + channel * format_.sample_bytes;
    if (format_.sample_bytes == sizeof(std::uint32_t)) {
      std::uint32_t raw = 0;
      std::memcpy(&raw, at, sizeof raw);
      return raw;
    }
    std::uint16_t raw = 0;
    std::memcpy(&raw, at, sizeof raw);
    return raw;
  }

  AnalogFormat format_;
  std::uint32_t channels_ = 0;
  Bytes scan_;
  std::size_t filled_ = 0;    ///< bytes of the scan under way
  std::uint64_t number_ = 0;  ///< of the next scan since begin()
  bool restarted_ = false;
};

}  // namespace

std::unique_ptr<Protocol> make_analog_scans(AnalogFormat format) {
  return std::make_unique<AnalogScans>(std::move(format));
}

}  // namespace merkel
