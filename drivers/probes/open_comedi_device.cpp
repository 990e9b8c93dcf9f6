// Compiled only if comedilib is found.
#include <cmath>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/parameters/parameter_error.hpp"
#include "drivers/files/csv_text.hpp"
#include "drivers/parsed_number.hpp"
#include "drivers/probes/device_probe.hpp"
#include "drivers/probes/open_device.hpp"
#include "drivers/transports/comedi_port.hpp"

namespace merkel {
namespace {

constexpr std::size_t kMaxAnalogChannels = 64;

/// "0,1" as numbers; empty: wrong.
std::vector<unsigned> analog_channels(std::string_view text) {
  std::vector<unsigned> channels;
  for (std::string_view rest = text; !rest.empty();) {
    const auto channel = parsed_number<unsigned>(take_field(rest));
    if (!channel) return {};
    channels.push_back(*channel);
  }
  return channels;
}

/// "-5:5,0:10" as pairs, "5" for -5:5; empty: wrong.
std::vector<std::pair<double, double>> analog_ranges(std::string_view text) {
  std::vector<std::pair<double, double>> ranges_V;
  for (std::string_view rest = text; !rest.empty();) {
    const std::string_view part = take_field(rest);
    const auto colon = part.find(':');
    const auto high = parse_number(colon == std::string_view::npos ? part : part.substr(colon + 1));
    const auto low = colon == std::string_view::npos ? (high ? std::optional(-*high) : std::nullopt)
                                                     : parse_number(part.substr(0, colon));
    if (!low || !high || !std::isfinite(*low) || !std::isfinite(*high) || *low >= *high) return {};
    ranges_V.emplace_back(*low, *high);
  }
  return ranges_V;
}

/// Makes the factors of columns those to one volt. \return what is wrong; empty: nothing
std::string take_volts(std::vector<CsvColumn>& columns) {
  for (CsvColumn& column : columns) {
    if (column.kind == CsvColumn::Kind::kSkip || column.quantity == Quantity::kSync)
      continue;  // a sync line stays in V
    if (column.kind != CsvColumn::Kind::kValue) {
      return "a card counts its scans itself: write - for " + column.name +
             ", or leave out its channel";
    }
    const auto mark = column.name.rfind('_');
    const auto unit = unit_named(mark == std::string::npos ? "" : column.name.substr(mark + 1));
    if (!unit || unit->quantity != Quantity::kVoltage) {
      const std::string stem = column.name.substr(0, mark);
      return "a card measures volts, not " + column.name + ": write " + stem + "_V, and add " +
             stem + "_" + std::string(unit_of(column.quantity)) + "_per_V";
    }
    column.factor /= unit->factor;
  }
  return {};
}

}  // namespace

Expected<std::unique_ptr<Probe>, SetupError> open_comedi_device(const Uri& uri,
                                                                const DeviceUri& device) {
  const auto refuse = [&](const std::string& why) {
    return bad_input("\"" + uri.text + "\": " + why);
  };
  UriOptions options(uri);
  const std::string names = options.text("columns", "");
  const std::string channels = options.text("channels", "");
  const std::string ranges = options.text("range", "");
  ComediSettings card_settings{
      .node = uri.path,
      .channels = analog_channels(channels),
      .rate_Hz = options.number("rate_hz", 10'000.0, 1.0, 1e6),
      .ranges_V = analog_ranges(ranges),
      .reference = options.word("reference", "ground", "ground|common|differential|other")};
  DeviceProbe::Settings settings = DeviceProbe::settings_from(options, uri, device);
  const auto factors = UnitFactors::from(options);
  if (uri.path.empty()) return refuse("name the card, for example comedi:/dev/comedi0");
  if (!factors) return Unexpected<SetupError>(factors.error());
  if (names.empty()) {
    return refuse(
        "name what the channels measure, for example channels=0,1&columns=force_V,position_V&"
        "force_N_per_V=0.17553&position_mm_per_V=2.5");
  }
  auto named = csv_columns_named(names, ',', *factors);
  std::string fault = named ? take_volts(*named) : named.error();
  if (!fault.empty()) return refuse("columns=" + names + ": " + fault);
  std::vector<CsvColumn>& columns = *named;
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  if (channels.empty()) {
    for (unsigned i = 0; i < columns.size(); ++i) card_settings.channels.push_back(i);
  }
  if (card_settings.channels.size() != columns.size() || columns.size() > kMaxAnalogChannels) {
    return refuse("channels=" + channels + " must be one number for each of the " +
                  std::to_string(columns.size()) + " columns, at most " +
                  std::to_string(kMaxAnalogChannels) + ", such as 0,1");
  }
  const std::size_t count = card_settings.ranges_V.size();
  if (!ranges.empty() && count != 1 && count != columns.size()) {
    return refuse("range=" + ranges +
                  " must be the lowest and highest voltage, such as -5:5, of all channels or of "
                  "each, separated by commas");
  }
  auto card = open_comedi_card(card_settings);
  if (!card) return Unexpected<SetupError>(card.error());
  card->format.columns = std::move(columns);
  if (settings.times == ReadingTimes::Rule::kMapped) {
    settings.times = ReadingTimes::Rule::kBuffered;
  }
  settings.protocol = "comedi";
  settings.hint = "that no other program uses the card";
  return DeviceProbe::open(std::move(card->port), make_analog_scans(std::move(card->format)),
                           std::move(settings));
}

}  // namespace merkel
