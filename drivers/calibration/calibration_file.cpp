#include <algorithm>
#include <cmath>
#include <sstream>

#include "core/parameters/nearest_name.hpp"
#include "core/parameters/parameter_error.hpp"
#include "drivers/calibration/probe_calibration.hpp"
#include "drivers/files/input_file.hpp"
#include "drivers/files/toml.hpp"
#include "drivers/protocols/csv_columns.hpp"
#include "drivers/protocols/unit_factors.hpp"

namespace merkel {
namespace {

const std::array<std::string, 7> kKeys = {"source", "gain",  "zero",    "saturation",
                                          "range",  "noise", "residual"};

std::string quoted(const std::string& text) {
  const toml::value<std::string> value(text);
  std::ostringstream written;
  written << toml::toml_formatter(value, toml::format_flags::allow_unicode_strings);
  return written.str();
}

std::string at(const std::string& path, const toml::node& node) {
  return path + ":" + std::to_string(node.source().begin.line) + ": ";
}

Expected<ChannelCalibration, SetupError> read_channel(const std::string& path,
                                                      std::string_view name,
                                                      const toml::table& table) {
  ChannelCalibration channel;
  channel.from_file = true;
  bool has_source = false;
  for (const auto& [key, node] : table) {
    const std::string word(key.str());
    const std::string full = std::string(name) + "." + word;
    if (word == "source") {
      const auto source = node.value<std::string>().value_or("");
      const auto* const found =
          std::find(kDeviceChannelNames.begin(), kDeviceChannelNames.end(), source);
      const auto own = csv_column_named(source);
      if (own && own->kind == CsvColumn::Kind::kValue && is_named(own->channel) &&
          own->quantity != Quantity::kSync) {
        channel.source = own->channel;
        channel.name = source;
        has_source = true;
        continue;
      }
      if (found == kDeviceChannelNames.end()) {
        return bad_input(at(path, node) + full +
                         " must be one of force, force_x, force_y, force_z, depth, x, y, z, or a "
                         "channel of its own name with its unit, such as thumb_N");
      }
      channel.source = static_cast<DeviceChannel>(found - kDeviceChannelNames.begin());
      has_source = true;
      continue;
    }
    if (std::find(kKeys.begin(), kKeys.end(), word) == kKeys.end()) {
      return bad_input(at(path, node) + "the key " + full + " is unknown" +
                       did_you_mean(word, kKeys));
    }
    if (word == "range") {
      const toml::array* const ends = node.as_array();
      const auto end = [&](std::size_t i) {
        return ends != nullptr && ends->size() == 2
                   ? (*ends)[i].value<double>().value_or(std::nan(""))
                   : std::nan("");
      };
      const std::array<double, 2> range = {end(0), end(1)};
      if (!(range[0] < range[1]) || !std::isfinite(range[0]) || !std::isfinite(range[1])) {
        return bad_input(at(path, node) + full +
                         " must be the smallest and the largest known point, such as [0.0, 2.0]");
      }
      channel.range = range;
      continue;
    }
    const auto number = node.value<double>();
    if (!number || !std::isfinite(*number)) {
      return bad_input(at(path, node) + full + " must be a finite number");
    }
    if (word == "gain" && *number == 0.0) {
      return bad_input(at(path, node) + full + " must not be 0: the probe would measure nothing");
    }
    if (word == "gain") channel.gain = *number;
    if (word == "zero") channel.zero = *number;
    if (word == "saturation") channel.saturation = *number;
    if (word == "noise") channel.noise = *number;
    if (word == "residual") channel.residual = *number;
  }
  if (!has_source) {
    return bad_input(at(path, table) + std::string(name) +
                     ".source is missing: add the device's channel, for example \"force\"");
  }
  return channel;
}

}  // namespace

Expected<ProbeCalibration, SetupError> read_calibration(const std::string& path) {
  const auto text = read_whole_file(path, "calibration", kMaxTomlBytes);
  if (!text) return Unexpected<SetupError>(text.error());
  const auto file = parse_toml(*text);
  if (!file) {
    return bad_input(path + ":" + std::to_string(file.error().line) +
                     ": this is not valid TOML: " + file.error().reason);
  }
  ProbeCalibration calibration;
  UnitFactors factors;
  for (const auto& [key, node] : *file) {
    const std::string word(key.str());
    if (UnitFactors::is_key(word)) {
      const double factor = node.value<double>().value_or(std::nan(""));
      if (const std::string wrong = factors.add(word, factor); !wrong.empty()) {
        return bad_input(at(path, node) + wrong);
      }
      calibration.factors.emplace_back(word, factor);
      continue;
    }
    if (word == "serial_number" || word == "date") {
      const auto value = node.value<std::string>();
      if (!value) return bad_input(at(path, node) + word + " must be a text in quotes");
      (word == "date" ? calibration.date : calibration.serial_number) = *value;
      continue;
    }
    const auto* const found = std::ranges::find(kProbeChannels, word, &SampleChannel::name);
    if (found == kProbeChannels.end() || !node.is_table()) {
      return bad_input(at(path, node) + "\"" + word +
                       "\" is unknown: a calibration has serial_number, date, factors such "
                       "as force_N_per_V, and the tables depth, force, x and y");
    }
    auto channel = read_channel(path, word, *node.as_table());
    if (!channel) return Unexpected<SetupError>(channel.error());
    calibration.channels[static_cast<std::size_t>(found - kProbeChannels.begin())] = *channel;
  }
  return calibration;
}

std::string calibration_text(const ProbeCalibration& calibration, const std::string& comment) {
  std::ostringstream text;
  text << "# " << comment << "\n# sample = gain · (reading − zero); forces in N, lengths in mm\n"
       << "serial_number = " << quoted(calibration.serial_number)
       << "\ndate = " << quoted(calibration.date) << "\n";
  const auto number = [](double value) {
    const std::string digits = shortest_decimal(value);
    // A TOML float needs a decimal point.
    return digits.find_first_of(".e") == std::string::npos ? digits + ".0" : digits;
  };
  for (const auto& [key, factor] : calibration.factors)
    text << key << " = " << number(factor) << "\n";
  for (std::size_t i = 0; i < calibration.channels.size(); ++i) {
    const auto& channel = calibration.channels[i];
    if (!channel) continue;
    const std::string source = is_named(channel->source) ? channel->name : channel->stem();
    text << "\n[" << kProbeChannels[i].name << "]\nsource = " << quoted(source)
         << "\ngain = " << number(channel->gain) << "\nzero = " << number(channel->zero) << "\n";
    if (channel->saturation) text << "saturation = " << number(*channel->saturation) << "\n";
    if (channel->range) {
      text << "range = [" << number(channel->range->front()) << ", "
           << number(channel->range->back()) << "]  # of the known points\n";
    }
    text << "noise = " << number(channel->noise)
         << "     # rms\nresidual = " << number(channel->residual)
         << "  # rms about the known points\n";
  }
  return text.str();
}

}  // namespace merkel
