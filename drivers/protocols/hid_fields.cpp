#include "drivers/protocols/hid_fields.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

#include "core/units.hpp"
#include "drivers/files/csv_text.hpp"
#include "drivers/protocols/csv_columns.hpp"
#include "drivers/protocols/sequence_counter.hpp"
#include "drivers/take_part.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

/// The raw value of a field; empty if the report is too short.
std::optional<std::int64_t> read_field(const HidField& field,
                                       std::span<const std::uint8_t> report) {
  if (field.offset + field.bits > 8 * report.size()) return std::nullopt;
  std::uint64_t raw = 0;
  for (std::size_t bit = 0; bit < field.bits; ++bit) {
    const std::size_t at = field.offset + bit;
    const std::uint64_t value = (report[at / 8] >> (at % 8)) & 1U;
    raw |= value << bit;
  }
  const bool negative = field.is_signed && ((raw >> (field.bits - 1)) & 1U) != 0U;
  return static_cast<std::int64_t>(raw) - (negative ? std::int64_t{1} << field.bits : 0);
}

/// Parses a field, or returns an error.
Expected<HidField, std::string> field_of(std::string_view text, const UnitFactors& factors) {
  std::string_view rest = text;
  const std::string_view name = take_part(rest, ':');
  const auto offset = parse_number(take_part(rest, ':'));
  const auto bits = parse_number(take_part(rest, ':'));
  const std::string_view sign = take_part(rest, ':');
  const auto scale = parse_number(rest.empty() ? "1" : rest);
  const auto whole = [](const std::optional<double>& number, double low, double high) {
    return number && *number >= low && *number <= high && *number == std::floor(*number);
  };
  if (!whole(offset, 0.0, static_cast<double>(HidFieldMap::kLastBit)) ||
      !whole(bits, 1.0, static_cast<double>(HidFieldMap::kMaxBits)) ||
      (sign != "s" && sign != "u") || !scale || !std::isfinite(*scale) || *scale == 0.0) {
    return Unexpected<std::string>("\"" + std::string(text) +
                                   "\" must be CHANNEL_UNIT:OFFSET:BITS:s|u:SCALE with 1 to 32 "
                                   "bits and a scale other than 0, for example "
                                   "force_N:0:16:s:0.001");
  }
  HidField field{.offset = static_cast<std::size_t>(*offset),
                 .bits = static_cast<std::size_t>(*bits),
                 .is_signed = sign == "s",
                 .scale = *scale};
  if (name == "seq" || name == "time_us" || name == "time_ms") {
    field.kind = name == "seq" ? HidField::Kind::kSequence : HidField::Kind::kTime;
    field.scale *= name == "time_us" ? 1e3 : 1e6;
    if (field.is_signed) {
      return Unexpected<std::string>(std::string(name) + " must be unsigned: write u");
    }
    if (field.scale < 0.0) {
      return Unexpected<std::string>(std::string(name) + " must have a positive scale");
    }
    return field;
  }
  const auto column = csv_column_named(name, factors);
  if (!column || column->kind != CsvColumn::Kind::kValue) {
    return Unexpected<std::string>(
        !column && (column.error().starts_with("the unit") ||
                    !UnitFactors::key_in(column.error()).empty())
            ? column.error()
            : "the channel " + std::string(name) +
                  " is unknown; the known ones are force_N, force_x_N, force_y_N, force_z_N, depth_mm, "
                  "x_mm, y_mm, z_mm, names of your own with a unit, such as thumb_N, and time_us, "
                  "time_ms, seq");
  }
  if (is_named(column->channel)) {
    field.channel = {
        .name = column->name, .channel = column->channel, .quantity = column->quantity};
  } else {
    field.channel = names_of_channels(bit_of(column->channel)).front();
  }
  field.scale *= column->factor;
  return field;
}

class HidFields final : public Protocol {
 public:
  explicit HidFields(HidFieldMap map)
      : fields_(std::move(map.fields)), report_id_(map.report_id), rate_Hz_(map.rate_Hz) {
    for (const HidField& field : fields_) {
      if (field.kind == HidField::Kind::kValue) channels_ |= bit_of(field.channel.channel);
      if (field.kind == HidField::Kind::kSequence) {
        sequence_ = SequenceCounter(static_cast<unsigned>(field.bits));
      }
      if (field.kind == HidField::Kind::kTime) {
        wrap_ = nanoseconds{
            std::llround(static_cast<double>(std::int64_t{1} << field.bits) * field.scale)};
      }
    }
  }

  void begin(nanoseconds /*now*/, DeviceStream& /*stream*/) override {}

  void take(std::span<const std::uint8_t> bytes, nanoseconds arrival,
            DeviceStream& stream) override {
    if (bytes.empty()) return;
    stream.counts.bytes += bytes.size();
    if (report_id_ != 0) {
      if (bytes[0] != report_id_) {
        ++stream.counts.frames;  // another report of the device
        return;
      }
      bytes = bytes.subspan(1);
    }
    DeviceReading reading;
    reading.arrival = arrival;
    for (const HidField& field : fields_) {
      const auto raw = read_field(field, bytes);
      if (!raw) {
        ++stream.counts.damaged;  // shorter than the map requires
        return;
      }
      if (field.has_range && (*raw < field.low || *raw > field.high)) {
        ++stream.counts.frames;
        ++stream.counts.refused;
        ++stream.counts.without_value;
        return;
      }
      const double value = static_cast<double>(*raw) * field.scale + field.bias;
      switch (field.kind) {
        case HidField::Kind::kValue:
          reading.set(field.channel.channel, value);
          // The low end of an unsigned range means no contact, not saturation.
          reading.saturated =
              reading.saturated ||
              (field.has_range && (*raw == field.high || (field.is_signed && *raw == field.low)));
          break;
        case HidField::Kind::kTime:
          reading.set_time(value);
          break;
        case HidField::Kind::kSequence: {
          const auto step = sequence_.next(static_cast<std::uint32_t>(*raw), stream);
          if (step.dropped()) return;
          reading.lost = step.lost;
          reading.rebooted = step.restarted;
          break;
        }
      }
    }
    ++stream.counts.frames;
    stream.accept(reading);
  }

  [[nodiscard]] std::string expected(std::string_view /*answer*/) const override {
    std::size_t bits = 0;
    for (const HidField& field : fields_) bits = std::max(bits, field.offset + field.bits);
    return "reports" + (report_id_ == 0 ? "" : " with the id " + std::to_string(report_id_)) +
           " of at least " + std::to_string((bits + 7) / 8 + (report_id_ == 0 ? 0 : 1)) + " bytes";
  }
  [[nodiscard]] std::uint32_t channels() const noexcept override { return channels_; }
  [[nodiscard]] bool ready() const noexcept override { return true; }
  [[nodiscard]] std::vector<ChannelName> channel_names() const override {
    std::vector<ChannelName> names;
    for (std::size_t i = 0; i < fields_.size(); ++i) {
      if (fields_[i].kind != HidField::Kind::kValue) continue;
      names.push_back(fields_[i].channel);
      names.back().column = i + 1;
    }
    return names;
  }
  [[nodiscard]] std::optional<nanoseconds> clock_wrap() const noexcept override { return wrap_; }
  [[nodiscard]] std::optional<nanoseconds> period() const noexcept override {
    return period_of(rate_Hz_);
  }

 private:
  std::vector<HidField> fields_;
  std::uint8_t report_id_;
  double rate_Hz_;
  std::uint32_t channels_ = 0;
  SequenceCounter sequence_{32};
  std::optional<nanoseconds> wrap_;
};

}  // namespace

Expected<HidFieldMap, SetupError> read_hid_fields(UriOptions& options) {
  const std::string text = options.text("fields", "");
  HidFieldMap map{.fields = {},
                  .report_id = static_cast<std::uint8_t>(options.whole("report_id", 0, 0, 255)),
                  .rate_Hz = options.number("rate_hz", 0.0, 0.1, 20'000.0)};
  if (text.empty()) return map;
  const auto factors = UnitFactors::from(options);
  if (!factors) return Unexpected<SetupError>(factors.error());
  bool measures = false;
  std::size_t own_names = 0;
  std::vector<CsvColumn> columns;
  std::string_view rest = text;
  while (!rest.empty()) {
    const std::string_view part = take_part(rest, ',');
    const auto field = field_of(part, *factors);
    if (!field) return bad_input("fields: " + field.error());
    const CsvColumn column = *csv_column_named(part.substr(0, part.find(':')), *factors);
    if (const std::string why = repeated_column(columns, column); !why.empty()) {
      return bad_input("fields: " + why);
    }
    columns.push_back(column);
    measures = measures || field->kind == HidField::Kind::kValue;
    map.fields.push_back(*field);
    DeviceChannel& added = map.fields.back().channel.channel;
    if (is_named(added)) added = named_channel(own_names++);
  }
  if (!measures) {
    return bad_input(
        "the option fields must contain a force, a depth or a position in the reports, "
        "for example fields=force_N:0:16:s:0.001");
  }
  return map;
}

std::unique_ptr<Protocol> make_hid_fields(HidFieldMap map) {
  return std::make_unique<HidFields>(std::move(map));
}

}  // namespace merkel
