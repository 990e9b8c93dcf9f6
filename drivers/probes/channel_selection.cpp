#include "drivers/probes/channel_selection.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

#include "core/parameters/nearest_name.hpp"
#include "drivers/parsed_number.hpp"
#include "drivers/printable_text.hpp"
#include "drivers/protocols/device_units.hpp"
#include "drivers/take_part.hpp"

namespace merkel {
namespace {

constexpr std::size_t kForcePlace = 1;  ///< in kProbeChannels
constexpr std::size_t kMaxListed = 12;

std::string_view without_unit(std::string_view name) { return name.substr(0, name.rfind('_')); }

/// A channel by its name, by its name without the unit, or by its column.
Expected<ChannelName, std::string> find(std::string_view name,
                                        std::span<const ChannelName> channels) {
  const auto column = parsed_number<std::size_t>(name);
  std::vector<ChannelName> found;
  for (const ChannelName& each : channels) {
    if (each.name == name || in_unit_of_readings(each) == name) return each;
    if (column ? each.column == *column : without_unit(each.name) == name) found.push_back(each);
  }
  if (found.size() == 1) return found.front();
  if (found.size() > 1) {
    return Unexpected<std::string>("there are several channels \"" + std::string(name) +
                                   "\": name one with its unit; the device has " +
                                   listed_channels(channels));
  }
  std::vector<std::string> names;
  for (const ChannelName& each : channels) names.push_back(each.name);
  return Unexpected<std::string>(
      (column ? "column " + std::string(name) + " is no force and no length"
              : "there is no channel \"" + std::string(name) + "\"") +
      (column ? ":" : did_you_mean(name, names, ":")) + " " +
      (channels.empty() ? "the device names none" : "The device has " + listed_channels(channels)));
}

constexpr std::string_view kTaxels = "taxels=";
constexpr double kUm2_per_mm2 = 1e6;

std::optional<ChannelSelection::Taxels> parse_taxels(std::string_view text) {
  constexpr std::size_t kMaxTaxels = 1024;
  ChannelSelection::Taxels taxels;
  const std::string_view size = text.substr(0, text.find(':'));
  if (size.size() < text.size()) taxels.prefix = text.substr(size.size() + 1);
  const std::size_t star = size.find('*');
  taxels.count = parsed_number<std::size_t>(size.substr(0, star)).value_or(0);
  if (taxels.count < 1 || taxels.count > kMaxTaxels) return std::nullopt;
  if (star == std::string_view::npos) return taxels;
  const auto area_um2 = parsed_number<std::uint64_t>(size.substr(star + 1));
  if (area_um2.value_or(0) == 0) return std::nullopt;
  taxels.area_mm2 = static_cast<double>(*area_um2) / kUm2_per_mm2;
  return taxels;
}

}  // namespace

std::string listed_channels(std::span<const ChannelName> channels) {
  std::string list;
  for (std::size_t i = 0; i < std::min(channels.size(), kMaxListed); ++i) {
    list += (i == 0 ? "" : ", ") + printable_text(channels[i].name);
  }
  if (channels.size() > kMaxListed) {
    list += " and " + std::to_string(channels.size() - kMaxListed) + " more";
  }
  return list;
}

std::string in_unit_of_readings(const ChannelName& channel) {
  if (channel.quantity == Quantity::kSync) return channel.name;
  return std::string(without_unit(channel.name)) + "_" + std::string(unit_of(channel.quantity));
}

bool ChannelSelection::empty() const noexcept {
  return by_unit.empty() && !taxels &&
         std::all_of(of.begin(), of.end(), [](const std::string& name) { return name.empty(); });
}

Expected<ChannelSelection, std::string> ChannelSelection::parse(std::string_view fragment) {
  ChannelSelection channels;
  while (!fragment.empty()) {
    const std::string_view part = take_part(fragment, ',');
    const auto equals = part.find('=');
    if (part.empty() || equals + 1 == part.size()) {
      return Unexpected<std::string>(
          "the part after # must name channels, for example #force=thumb_N");
    }
    if (equals == std::string_view::npos) {
      channels.by_unit.emplace_back(part);
      continue;
    }
    if (part.starts_with(kTaxels)) {
      channels.taxels = parse_taxels(part.substr(kTaxels.size()));
      if (channels.taxels) continue;
      return Unexpected<std::string>(
          "taxels= after # must be the number of taxels and the area of one in µm², for example "
          "#taxels=256*810000");
    }
    const auto* const key =
        std::ranges::find(kProbeChannels, part.substr(0, equals), &SampleChannel::name);
    if (key == kProbeChannels.end()) {
      return Unexpected<std::string>("\"" + std::string(part.substr(0, equals)) +
                                     "\" after # must be force, depth, x or y, for example "
                                     "#force=thumb_N");
    }
    std::string& name = channels.of[static_cast<std::size_t>(key - kProbeChannels.begin())];
    if (!name.empty()) {
      return Unexpected<std::string>("the " + std::string(key->name) +
                                     " after # is named twice: keep one");
    }
    name = part.substr(equals + 1);
  }
  return channels;
}

std::string ChannelSelection::text() const {
  std::string text;
  const auto add = [&text](const std::string& part) { text += (text.empty() ? "" : ",") + part; };
  if (taxels) {
    add(std::string(kTaxels) + std::to_string(taxels->count) + "*" +
        std::to_string(std::llround(kUm2_per_mm2 * taxels->area_mm2)) +
        (taxels->prefix.empty() ? "" : ":" + taxels->prefix));
  }
  for (const std::string& name : by_unit) add(name);
  for (std::size_t i = 0; i < of.size(); ++i) {
    if (!of[i].empty()) add(std::string(kProbeChannels[i].name) + "=" + of[i]);
  }
  return text;
}

Expected<ProbeCalibration, std::string> ChannelSelection::among(
    std::span<const ChannelName> channels) const {
  ProbeCalibration calibration;
  if (empty()) {
    std::uint32_t bits = 0;
    for (const ChannelName& each : channels) bits |= bit_of(each.channel);
    calibration.complete(bits);
    return calibration;
  }
  const auto put = [&](std::size_t place, const std::string& name,
                       bool by_its_unit) -> Expected<void, std::string> {
    const auto found = find(name, channels);
    if (!found) return Unexpected<std::string>(found.error());
    if (found->quantity == Quantity::kSync) {
      return Unexpected<std::string>("the channel " + found->name +
                                     " is a sync line, and no force or length");
    }
    if (found->quantity == Quantity::kPressure) {
      return Unexpected<std::string>(
          "the channel " + found->name +
          " is a pressure: it can be a taxel (tip = \"taxels\"), but no " + "force or length");
    }
    const bool force = found->quantity == Quantity::kForce;
    if (by_its_unit) place = force ? kForcePlace : 0;
    const std::string wanted(kProbeChannels[place].name);
    if (force != (place == kForcePlace)) {
      return Unexpected<std::string>("the channel " + found->name + " is a " +
                                     (force ? "force" : "length") + " and cannot be the " + wanted +
                                     ": choose one in " + (place == kForcePlace ? "N" : "mm"));
    }
    auto& channel = calibration.channels[place];
    if (channel) return Unexpected<std::string>("the " + wanted + " is chosen twice: keep one");
    // A calibration file is for N and mm, whatever the column is in.
    const auto unit = unit_named(found->name.substr(found->name.rfind('_') + 1));
    const bool electrical = unit && unit->is_electrical();
    channel = ChannelCalibration{.source = found->channel,
                                 .name = electrical ? in_unit_of_readings(*found) : found->name};
    if (place == 0 && found->channel == DeviceChannel::kZ) channel->gain = -1.0;
    return {};
  };
  for (const std::string& name : by_unit) {
    if (auto done = put(0, name, true); !done) return Unexpected<std::string>(done.error());
  }
  for (std::size_t i = 0; i < of.size(); ++i) {
    if (of[i].empty()) continue;
    if (auto done = put(i, of[i], false); !done) return Unexpected<std::string>(done.error());
  }
  return calibration;
}

std::string names_of_channels(const ProbeCalibration& calibration) {
  std::string names;
  for (const auto& channel : calibration.channels) {
    if (channel) names += (names.empty() ? "" : ", ") + printable_text(channel->name);
  }
  return names;
}

std::string wrong_taxels(std::size_t count, const ChannelSelection::Taxels& wanted) {
  if (count == wanted.count) return {};
  return "the array has " + std::to_string(wanted.count) + " taxels, but " + std::to_string(count) +
         " channels are forces or pressures" +
         (wanted.prefix.empty() ? "" : " whose names begin with " + printable_text(wanted.prefix)) +
         ": correct taxel_columns and taxel_rows, name the columns of the device "
         "(columns=taxel_kPa*" +
         std::to_string(wanted.count) + "), or choose channels by the key taxel_channels";
}

std::string no_press_among(std::span<const std::string> channels) {
  std::vector<ChannelName> names;
  for (const std::string& name : channels) names.push_back({.name = name, .channel = {}});
  return "it has the channels " + listed_channels(names) +
         ", none of which is called force or depth: choose one for each probe, by #" +
         printable_text(channels.empty() ? "thumb_N" : channels.front()) +
         " at the end of the URI, or in a scene by [[device]] and the key force or depth of "
         "[[probe]]";
}

std::pair<std::string, std::optional<std::string>> split_fragment(std::string_view uri) {
  const auto mark = uri.rfind('#');
  const bool fused = uri.starts_with("fused:");  // its members have parts of their own
  if (fused || mark == std::string_view::npos ||
      uri.find_first_of("./?&", mark) != std::string_view::npos) {
    return {std::string(uri), std::nullopt};
  }
  return {std::string(uri.substr(0, mark)), std::string(uri.substr(mark + 1))};
}

Expected<DeviceUri, SetupError> DeviceUri::parse(std::string_view text) {
  const auto [uri, part] = split_fragment(text);
  DeviceUri device{.uri = uri};
  if (!part) return device;
  auto channels = ChannelSelection::parse(*part);
  if (!channels) return bad_input("\"" + uri + "\": " + channels.error());
  device.parts.push_back(std::move(*channels));
  return device;
}

}  // namespace merkel
