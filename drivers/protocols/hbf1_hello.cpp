#include "drivers/protocols/hbf1_hello.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/units.hpp"
#include "drivers/protocols/csv_columns.hpp"
#include "drivers/protocols/hbf1_frame.hpp"

namespace merkel {
namespace {

constexpr std::uint8_t kUnnamedHello = 1;  ///< versions of the HELLO
constexpr std::uint8_t kNamedHello = 2;

bool is_force_kind(std::uint8_t kind) noexcept { return kind < kHbf1FirstLength; }
bool is_length_kind(std::uint8_t kind) noexcept {
  return !is_force_kind(kind) && kind < kHbf1Kinds.size();
}

/// The unit of a kind's readings; null if it is not used.
const char* unit_of_kind(std::uint8_t kind) noexcept {
  if (kind == kHbf1Pressure) return "kPa";
  return is_force_kind(kind) ? "N" : (is_length_kind(kind) ? "mm" : nullptr);
}

bool suits_kind(std::uint8_t unit, std::uint8_t kind) noexcept {
  if (unit == kHbf1Raw || unit_of_kind(kind) == nullptr) return true;
  if (kind == kHbf1Pressure) return unit == kHbf1Kilopascal;
  if (is_force_kind(kind)) return unit == kHbf1Newton;
  return unit == kHbf1Millimetre || unit == kHbf1Micrometre;
}

Hbf1Hello::Error hello_error(const std::string& sentence) {
  return {.sentence = "its HELLO message " + sentence};
}

}  // namespace

std::string hbf1_text(std::span<const std::uint8_t> bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    text += byte >= 0x20 && byte < 0x7F ? static_cast<char>(byte) : '?';
  }
  return text;
}

/// Reads a body from its beginning. After its end it returns zeros and empty texts.
class Hbf1Hello::Body {
 public:
  explicit Body(std::span<const std::uint8_t> bytes) : rest_(bytes) {}

  [[nodiscard]] bool at_end() const noexcept { return rest_.empty(); }
  [[nodiscard]] bool too_short() const noexcept { return too_short_; }
  std::uint8_t byte() {
    const auto bytes = take(1);
    return bytes.empty() ? std::uint8_t{0} : bytes[0];
  }
  std::uint16_t u16() {
    const auto bytes = take(2);
    return bytes.empty() ? std::uint16_t{0} : read_u16(bytes.first<2>());
  }
  double f32() {
    const auto bytes = take(4);
    return bytes.empty() ? 0.0
                         : static_cast<double>(std::bit_cast<float>(read_u32(bytes.first<4>())));
  }
  /// Its length is its first byte.
  std::string text() { return hbf1_text(take(byte())); }

 private:
  /// The next bytes; empty if there are fewer.
  std::span<const std::uint8_t> take(std::size_t count) {
    if (count > rest_.size()) {
      too_short_ = true;
      rest_ = {};
      return {};
    }
    const auto head = rest_.first(count);
    rest_ = rest_.subspan(count);
    return head;
  }

  std::span<const std::uint8_t> rest_;
  bool too_short_ = false;
};

/// A channel of the list, or several like ones.
struct Hbf1Hello::Entry {
  std::uint8_t kind = 0, format = 0, unit = 0;
  double scale = 1.0, offset = 0.0;
  std::uint8_t repeats = 1;
  std::string name = {};
  bool may_be_named = false;

  Entry(Body& body, bool named)
      : kind(body.byte()),
        format(body.byte()),
        unit(body.byte()),
        scale(body.f32()),
        offset(body.f32()),
        may_be_named(named) {
    if (!named) return;
    repeats = body.byte();
    name = body.text();
  }
};

Expected<bool, Hbf1Hello::Error> Hbf1Hello::take(std::span<const std::uint8_t> bytes) {
  const Unexpected<Error> damaged(Error{});
  Body body(bytes);
  const std::uint8_t version = body.byte();
  const std::size_t count = body.byte();
  const std::uint16_t rate_Hz = body.u16();
  std::string serial_number = body.text();
  static_cast<void>(body.text());  // the firmware's name
  const bool named = version == kNamedHello;
  const std::size_t first = named ? body.byte() : 0;
  if (body.too_short() || count == 0 || body.at_end() || (!named && version != kUnnamedHello)) {
    return damaged;
  }
  if (first == 0) {
    *this = Hbf1Hello();
    count_ = count;
    rate_Hz_ = rate_Hz;
    serial_number_ = std::move(serial_number);
  }
  if (first != layout_.size() || count != count_) return false;  // a frame before it was lost
  while (!body.at_end()) {
    const Entry entry(body, named);
    if (body.too_short() || entry.repeats == 0 || layout_.size() + entry.repeats > count_) {
      return damaged;
    }
    if (const auto error = add(entry)) return Unexpected<Error>(*error);
  }
  if (layout_.size() < count_) return named ? Expected<bool, Error>(false) : damaged;
  if (const auto error = check_whole()) return Unexpected<Error>(*error);
  return true;
}

std::optional<Hbf1Hello::Error> Hbf1Hello::add(const Entry& entry) {
  if (entry.kind > kHbf1LastKind || static_cast<Hbf1Format>(entry.format) > Hbf1Format::kFloat ||
      !std::isfinite(entry.scale) || !std::isfinite(entry.offset)) {
    return Error{};
  }
  const std::string number = std::to_string(layout_.size() + 1);
  if (entry.unit > kHbf1LastUnit) {
    return hello_error("reports channel " + number + " in the unknown unit " +
                       std::to_string(entry.unit) +
                       ": the known ones are 0 raw, 1 N, 2 mm, 3 um, 4 degC and 5 kPa");
  }
  if (entry.may_be_named && !suits_kind(entry.unit, entry.kind)) {
    return hello_error("reports channel " + number + ", of the kind " + std::to_string(entry.kind) +
                       ", in the unit " + std::to_string(entry.unit) +
                       ": forces are in N, lengths in mm or um, pressures in kPa");
  }
  const double factor = entry.unit == kHbf1Micrometre ? units::mm_from_um(1.0) : 1.0;
  for (std::size_t i = 1; i <= entry.repeats; ++i) {
    Channel channel{.channel = std::nullopt,
                    .format = static_cast<Hbf1Format>(entry.format),
                    .scale = factor * entry.scale,
                    .offset = factor * entry.offset};
    const std::string numbered =
        entry.name.empty() || entry.repeats == 1 ? entry.name : entry.name + std::to_string(i);
    if (unit_of_kind(entry.kind) != nullptr) {
      if (const auto error = name(entry, numbered, channel)) return error;
    }
    sample_bytes_ += channel.bytes();
    layout_.push_back(channel);
  }
  return std::nullopt;
}

/// Gives a measured channel its place among the values of a reading, and its name.
std::optional<Hbf1Hello::Error> Hbf1Hello::name(const Entry& entry, const std::string& name,
                                                Channel& channel) {
  const std::string number = std::to_string(layout_.size() + 1);
  ChannelName named{.name = {}, .channel = DeviceChannel::kForce};
  if (name.empty()) {
    if (entry.kind >= kHbf1Kinds.size()) return hello_error("gives channel " + number + " no name");
    named = names_of_channels(bit_of(kHbf1Kinds[entry.kind])).front();
  } else {
    if (!std::all_of(name.begin(), name.end(), is_in_hbf1_name)) {
      return hello_error("names channel " + number + " \"" + name +
                         "\": a name has letters, digits, - and _");
    }
    const auto column = csv_column_named(name + "_" + unit_of_kind(entry.kind));
    if (!column || column->kind != CsvColumn::Kind::kValue) {
      return hello_error("names channel " + number + " \"" + name +
                         "\", which means something else: choose another name");
    }
    named = {.name = column->name,
             .channel = is_named(column->channel) ? named_channel(own_names_++) : column->channel,
             .quantity = column->quantity};
  }
  named.column = layout_.size() + 1;
  const bool taken = std::any_of(names_.begin(), names_.end(), [&](const ChannelName& other) {
    return other.name == named.name;
  });
  if (taken && entry.may_be_named) {
    return hello_error("names two channels " + named.name + ": give each a name of its own");
  }
  channel.channel = named.channel;
  channels_ |= bit_of(named.channel);
  if (!taken) names_.push_back(std::move(named));
  return std::nullopt;
}

std::optional<Hbf1Hello::Error> Hbf1Hello::check_whole() const {
  constexpr std::size_t kMaxBytes = kHbf1LongestBody - kHbf1StatusBytes;
  if (names_.empty()) return hello_error("lists no channel of force, depth, position or pressure");
  if (sample_bytes_ > kMaxBytes) {
    return hello_error("lists channels of " + std::to_string(sample_bytes_) +
                       " bytes, but a sample carries " + std::to_string(kMaxBytes) +
                       ": send fewer channels, or 16 bits for each");
  }
  return std::nullopt;
}

void Hbf1Hello::number(std::vector<std::string>& known) {
  constexpr std::size_t kMaxNames = 2048;
  std::vector<std::optional<DeviceChannel>> numbers(own_names_);
  for (ChannelName& each : names_) {
    if (!is_named(each.channel)) continue;
    const auto place =
        static_cast<std::size_t>(std::find(known.begin(), known.end(), each.name) - known.begin());
    if (place == kMaxNames) continue;  // it is not used
    if (place == known.size()) known.push_back(each.name);
    auto& number = numbers[static_cast<std::size_t>(each.channel) - kDeviceChannels];
    number = each.channel = named_channel(place);
  }
  for (Channel& channel : layout_) {
    if (!channel.channel || !is_named(*channel.channel)) continue;
    channel.channel = numbers[static_cast<std::size_t>(*channel.channel) - kDeviceChannels];
  }
}

void Hbf1Hello::read_values(std::span<const std::uint8_t> values,
                            DeviceReading& reading) const noexcept {
  for (const Channel& channel : layout_) {
    double raw = 0.0;
    bool at_end = false;  // of its format
    switch (channel.format) {
      case Hbf1Format::kInt16: {
        const auto counts = static_cast<std::int16_t>(read_u16(values.first<2>()));
        at_end = counts == INT16_MAX || counts == INT16_MIN;
        raw = counts;
        break;
      }
      case Hbf1Format::kInt32: {
        const auto counts = static_cast<std::int32_t>(read_u32(values.first<4>()));
        at_end = counts == INT32_MAX || counts == INT32_MIN;
        raw = counts;
        break;
      }
      case Hbf1Format::kFloat:
        raw = static_cast<double>(std::bit_cast<float>(read_u32(values.first<4>())));
        break;
    }
    values = values.subspan(channel.bytes());
    if (!channel.channel) continue;
    reading.set(*channel.channel, raw * channel.scale + channel.offset);
    reading.saturated = reading.saturated || at_end;
  }
}

}  // namespace merkel
