#include "drivers/protocols/hid_report_descriptor.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/units.hpp"

namespace merkel {
namespace {

constexpr std::size_t kMaxDescriptorBytes = 4096;
constexpr std::size_t kMaxUsages = 1024;
constexpr std::size_t kDeepestStack = 16;

// Items without their size bits.
constexpr unsigned kInput = 0x80;
constexpr unsigned kOutput = 0x90;
constexpr unsigned kFeature = 0xb0;
constexpr unsigned kCollection = 0xa0;
constexpr unsigned kEndCollection = 0xc0;
constexpr unsigned kLongItem = 0xfe;

constexpr std::uint32_t kConstant = 1U;  ///< flag of an input: padding
constexpr std::uint32_t kVariable = 2U;
constexpr std::uint32_t kRelative = 4U;

// Usages, with the page in the upper half.
constexpr std::uint32_t kX = 0x0001'0030;
constexpr std::uint32_t kY = 0x0001'0031;
constexpr std::uint32_t kZ = 0x0001'0032;
constexpr std::uint32_t kSensorForce = 0x0020'0494;

// Units in SI: force 1 g·cm/s² and 1 slug·inch/s² in N, length 1 cm and 1 inch in mm.
constexpr double kN_per_dyne = 1e-5;
constexpr double kN_per_slug_inch = 14.593902937 * 0.0254;
constexpr double kMm_per_cm = 10.0;
constexpr double kMm_per_inch = 25.4;
constexpr double kNs_per_s = 1e9;

struct Globals {
  std::uint32_t usage_page = 0;
  std::int64_t low = 0;
  std::int64_t high = 0;
  std::int64_t physical_low = 0;
  std::int64_t physical_high = 0;
  std::uint32_t exponent = 0;
  std::uint32_t unit = 0;
  std::uint32_t bits = 0;
  std::uint32_t count = 0;
  std::uint8_t report = 0;
};

struct Locals {
  std::vector<std::uint32_t> usages;
  std::uint32_t first = 0;
};

struct Item {
  unsigned kind = 0;
  std::size_t bytes = 0;
  std::uint32_t value = 0;

  [[nodiscard]] std::int64_t signed_value() const noexcept {
    if (bytes == 0 || bytes == 4) return static_cast<std::int32_t>(value);
    const std::int64_t range = std::int64_t{1} << (8 * bytes);
    return value >= static_cast<std::uint64_t>(range / 2) ? std::int64_t{value} - range
                                                          : std::int64_t{value};
  }
};

int signed_nibble(std::uint32_t value) noexcept {
  const auto nibble = static_cast<int>(value & 0xfU);
  return nibble < 8 ? nibble : nibble - 16;
}

enum class Dimension { kNone, kForce, kLength, kTime, kOther };

/// The dimension of a unit, and the unit in N, mm or ns.
std::pair<Dimension, double> meaning_of(std::uint32_t unit) noexcept {
  if (unit == 0) return {Dimension::kNone, 1.0};
  const std::uint32_t system = unit & 0xfU;  // 1: cm, g, s; 3: inch, slug, s; others measure angles
  const bool si = system == 1;
  const std::uint32_t powers = unit >> 4U;
  if (powers == 0x100) return {Dimension::kTime, kNs_per_s};
  if (!si && system != 3) return {Dimension::kOther, 1.0};
  if (powers == 0xe11) return {Dimension::kForce, si ? kN_per_dyne : kN_per_slug_inch};
  if (powers == 0x001) return {Dimension::kLength, si ? kMm_per_cm : kMm_per_inch};
  return {Dimension::kOther, 1.0};
}

/// The meaning of a field; empty if it is not a quantity of a probe.
std::optional<HidField> field_of(const Globals& globals, std::uint32_t usage, std::size_t offset) {
  if (globals.bits == 0 || globals.bits > HidFieldMap::kMaxBits || globals.low >= globals.high) {
    return std::nullopt;
  }
  auto [dimension, factor] = meaning_of(globals.unit);
  if (dimension == Dimension::kNone && usage == kSensorForce) dimension = Dimension::kForce;
  HidField field{.offset = offset, .bits = globals.bits, .is_signed = globals.low < 0};
  DeviceChannel channel = DeviceChannel::kForce;
  switch (dimension) {
    case Dimension::kForce:
      channel = usage == kX   ? DeviceChannel::kForceX
                : usage == kY ? DeviceChannel::kForceY
                : usage == kZ ? DeviceChannel::kForceZ
                              : DeviceChannel::kForce;
      break;
    case Dimension::kLength:
      channel = usage == kX   ? DeviceChannel::kX
                : usage == kY ? DeviceChannel::kY
                : usage == kZ ? DeviceChannel::kZ
                              : DeviceChannel::kDepth;
      break;
    case Dimension::kTime:
      if (field.is_signed) return std::nullopt;
      field.kind = HidField::Kind::kTime;
      break;
    default:
      return std::nullopt;
  }
  const bool physical = globals.physical_low != 0 || globals.physical_high != 0;
  const double low = static_cast<double>(physical ? globals.physical_low : globals.low);
  const double high = static_cast<double>(physical ? globals.physical_high : globals.high);
  const double one = factor * std::pow(10.0, signed_nibble(globals.exponent));
  const double slope = (high - low) / static_cast<double>(globals.high - globals.low);
  field.scale = slope * one;
  if (field.kind == HidField::Kind::kTime) return slope > 0.0 ? std::optional(field) : std::nullopt;
  if (slope == 0.0) return std::nullopt;
  field.bias = (low - slope * static_cast<double>(globals.low)) * one;
  field.channel = names_of_channels(bit_of(channel)).front();
  field.has_range = true;
  field.low = globals.low;
  field.high = globals.high;
  return field;
}

class DescriptorReader {
 public:
  explicit DescriptorReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  /// The known fields of each report, or an error.
  Expected<std::array<std::vector<HidField>, 256>, std::string> read() {
    while (!bytes_.empty()) {
      const auto item = next();
      if (!item) return Unexpected<std::string>("its report descriptor ends within an item");
      if (const std::string error_message = take(*item); !error_message.empty()) {
        return Unexpected<std::string>(error_message);
      }
    }
    return std::move(fields_);
  }

 private:
  std::optional<Item> next() {
    const unsigned head = bytes_[0];
    if (head == kLongItem) {
      if (bytes_.size() < 3 || bytes_.size() < 3U + bytes_[1]) return std::nullopt;
      bytes_ = bytes_.subspan(3U + bytes_[1]);
      return Item{.kind = kLongItem};
    }
    Item item{.kind = head & 0xfcU, .bytes = (head & 3U) == 3U ? 4U : head & 3U};
    if (bytes_.size() < 1 + item.bytes) return std::nullopt;
    for (std::size_t i = 0; i < item.bytes; ++i) {
      item.value |= static_cast<std::uint32_t>(bytes_[1 + i]) << (8U * i);
    }
    bytes_ = bytes_.subspan(1 + item.bytes);
    return item;
  }

  /// Returns an error, or an empty string.
  std::string take(const Item& item) {
    switch (item.kind) {
      case kInput:
        return take_input(item.value);
      case kOutput:
      case kFeature:
      case kCollection:
      case kEndCollection:
        locals_ = {};
        return {};
      case 0x04:
        globals_.usage_page = item.value;
        return {};
      case 0x14:
        globals_.low = item.signed_value();
        return {};
      case 0x24:  // unsigned if the lowest value is not negative
        globals_.high = globals_.low < 0 ? item.signed_value() : std::int64_t{item.value};
        return {};
      case 0x34:
        globals_.physical_low = item.signed_value();
        return {};
      case 0x44:
        globals_.physical_high =
            globals_.physical_low < 0 ? item.signed_value() : std::int64_t{item.value};
        return {};
      case 0x54:
        globals_.exponent = item.value;
        return {};
      case 0x64:
        globals_.unit = item.value;
        return {};
      case 0x74:
        globals_.bits = item.value;
        return {};
      case 0x84:
        if (item.value == 0 || item.value > 255) return "its report IDs are out of range";
        globals_.report = static_cast<std::uint8_t>(item.value);
        return {};
      case 0x94:
        globals_.count = item.value;
        return {};
      case 0xa4:
        if (stack_.size() == kDeepestStack) return "its report descriptor is nested too deeply";
        stack_.push_back(globals_);
        return {};
      case 0xb4:
        if (stack_.empty()) return "its report descriptor has a Pop without a Push";
        globals_ = stack_.back();
        stack_.pop_back();
        return {};
      case 0x08:
        add_usage(whole_usage(item));
        return {};
      case 0x18:
        locals_.first = whole_usage(item);
        return {};
      case 0x28: {
        const std::uint32_t last = whole_usage(item);
        for (std::uint64_t usage = locals_.first;
             usage <= last && locals_.usages.size() < kMaxUsages; ++usage) {
          add_usage(static_cast<std::uint32_t>(usage));
        }
        return {};
      }
      default:
        return {};  // strings, designators, delimiters, long items
    }
  }

  [[nodiscard]] std::uint32_t whole_usage(const Item& item) const noexcept {
    return item.bytes == 4 ? item.value : (globals_.usage_page << 16U) | item.value;
  }
  void add_usage(std::uint32_t usage) {
    if (locals_.usages.size() < kMaxUsages) locals_.usages.push_back(usage);
  }

  std::string take_input(std::uint32_t flags) {
    std::size_t& offset = offsets_[globals_.report];
    const std::uint64_t bits = std::uint64_t{globals_.bits} * globals_.count;
    if (bits > HidFieldMap::kLastBit || offset + bits > HidFieldMap::kLastBit) {
      return "its report descriptor defines reports that are too long";
    }
    if ((flags & (kConstant | kVariable | kRelative)) == kVariable) {
      // Further fields repeat the last usage, of which only the first counts.
      const std::size_t named = std::min<std::size_t>(globals_.count, locals_.usages.size());
      for (std::size_t i = 0; i < named; ++i) {
        add_field(field_of(globals_, locals_.usages[i], offset + i * globals_.bits));
      }
    }
    offset += bits;
    locals_ = {};
    return {};
  }

  void add_field(const std::optional<HidField>& field) {
    if (!field) return;
    auto& fields = fields_[globals_.report];
    const bool known = std::any_of(fields.begin(), fields.end(), [&](const HidField& other) {
      return other.kind == field->kind && (field->kind == HidField::Kind::kTime ||
                                           other.channel.channel == field->channel.channel);
    });
    if (!known) fields.push_back(*field);
  }

  std::span<const std::uint8_t> bytes_;
  Globals globals_;
  Locals locals_;
  std::vector<Globals> stack_;
  std::array<std::size_t, 256> offsets_{};
  std::array<std::vector<HidField>, 256> fields_;
};

}  // namespace

Expected<HidFieldMap, std::string> map_report_descriptor(
    std::span<const std::uint8_t> descriptor, std::optional<std::uint8_t> wanted_report) {
  if (descriptor.size() > kMaxDescriptorBytes) {
    return Unexpected<std::string>("its report descriptor is too long");
  }
  auto reports = DescriptorReader(descriptor).read();
  if (!reports) return Unexpected<std::string>(reports.error());
  for (std::size_t id = 0; id < reports->size(); ++id) {
    if (wanted_report && id != *wanted_report) continue;
    auto& fields = (*reports)[id];
    if (std::none_of(fields.begin(), fields.end(),
                     [](const HidField& field) { return field.kind == HidField::Kind::kValue; })) {
      continue;
    }
    return HidFieldMap{.fields = std::move(fields), .report_id = static_cast<std::uint8_t>(id)};
  }
  return Unexpected<std::string>(
      "its report descriptor has no force, depth or position with a unit");
}

}  // namespace merkel
