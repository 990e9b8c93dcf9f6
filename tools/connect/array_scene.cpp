#include "tools/connect/array_scene.hpp"

#include <algorithm>
#include <cstdlib>
#include <string_view>

#include <fmt/core.h>

#include "drivers/probes/channel_selection.hpp"
#include "drivers/protocols/csv_columns.hpp"
#include "drivers/uri.hpp"
#include "tools/scene/scene_keys.hpp"

namespace merkel {
namespace {

/// "taxel_kPa" of "taxel17_kPa".
std::string without_number(const std::string& name) {
  const std::size_t unit = std::min(name.rfind('_'), name.size());
  std::size_t end = unit;
  while (end > 0 && name[end - 1] >= '0' && name[end - 1] <= '9') --end;
  return name.substr(0, end) + name.substr(unit);
}

}  // namespace

std::size_t taxels_among(const std::vector<std::string>& channels) {
  constexpr std::size_t kMinPressures = 2;
  std::size_t forces = 0;
  std::size_t pressures = 0;
  std::string name;
  bool alike = true;
  bool presses = false;  // it measures the press of one probe, too
  for (const std::string& channel : channels) {
    const auto column = csv_column_named(channel);
    if (!column || !is_named(column->channel)) {
      presses = presses || (column && column->channel <= DeviceChannel::kDepth);
      continue;
    }
    if (channel.ends_with("_mm") || column->quantity == Quantity::kSync) continue;
    ++(channel.ends_with("_kPa") ? pressures : forces);
    if (forces + pressures == 1) name = without_number(channel);
    alike = alike && without_number(channel) == name;
  }
  if (forces == 0) {
    return pressures < (presses ? kMinTaxels : kMinPressures) ? 0 : pressures;
  }
  const bool array = pressures == 0 && forces >= kMinTaxels && alike;
  return array && !name.starts_with("force_") ? forces : 0;
}

std::vector<std::string> channels_of(const std::string& uri) {
  const auto parsed = Uri::parse(uri);
  if (!parsed) return {};
  const auto option = parsed->options.find("columns");
  return option == parsed->options.end() ? std::vector<std::string>{} : channels_in(option->second);
}

std::vector<std::string> channels_in(const std::string& columns) {
  std::vector<std::string> channels;
  const auto named = csv_columns_named(columns, ',');
  if (!named) return channels;
  for (const CsvColumn& column : *named) {
    if (column.kind != CsvColumn::Kind::kValue || column.quantity == Quantity::kSync) continue;
    channels.push_back(in_unit_of_readings(
        {.name = column.name, .channel = column.channel, .quantity = column.quantity}));
  }
  return channels;
}

ArrayLayout ArrayLayout::of(std::size_t taxels, const std::string& uri) {
  if (const auto parsed = Uri::parse(uri); parsed && parsed->options.contains("frame_lines")) {
    const auto rows =
        static_cast<std::size_t>(std::atoi(parsed->options.find("frame_lines")->second.c_str()));
    if (rows > 0 && taxels % rows == 0) return {.columns = taxels / rows, .rows = rows};
  }
  std::size_t columns = 1;
  for (std::size_t i = 1; i * i <= taxels; ++i) {
    if (taxels % i == 0) columns = i;
  }
  return {.columns = columns, .rows = taxels / columns};
}

std::string array_scene_text(const std::string& uri, std::size_t taxels,
                             const std::vector<std::string>& lacking) {
  const ArrayLayout layout = ArrayLayout::of(taxels, uri);
  std::string text = fmt::format(
      "# Written by merkel connect.\n"
      "preset = \"goodwin\"  # afferents that the energy density drives\n\n"
      "[probe]\nuri = {}\ntip = \"taxels\"\n"
      "taxel_columns = {}  # along x, whose channels come first: set the layout of your array\n"
      "taxel_rows = {}     # along y\n"
      "taxel_pitch_mm = 1  # distance between centres: set that of your array\n"
      "taxel_width_mm = 1  # along x: set the size of a taxel\n"
      "taxel_length_mm = 1\n",
      toml_string(uri), layout.columns, layout.rows);
  for (const std::string& line : lacking) text += "# missing: " + line + "\n";
  return text;
}

}  // namespace merkel
