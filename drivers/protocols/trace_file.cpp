#include "drivers/protocols/trace_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "core/contact/taxel_array.hpp"
#include "core/parameters/nearest_name.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/units.hpp"
#include "drivers/files/csv_text.hpp"
#include "drivers/parsed_number.hpp"
#include "drivers/printable_text.hpp"
#include "drivers/protocols/csv_columns.hpp"
#include "drivers/sample_channels.hpp"
#include "drivers/sample_limits.hpp"

namespace merkel {
namespace {

const std::array<std::string, 5> kColumnNames = {"time_s", "depth_mm", "force_N", "x_mm", "y_mm"};
constexpr std::string_view kTraceStart = "# start_device_ns=";
constexpr std::string_view kTraceOffset = "# time_offset_ns=";
// Between the start of a run and its first sample.
constexpr double kTraceBeginning_ns = 1e8;
constexpr std::int64_t kLatestTraceTime_ns = 4'000'000'000'000'000'000;

/// What the model uses; else null.
const SampleChannel* sample_channel_of(DeviceChannel channel) noexcept {
  const auto found = std::ranges::find(kPressChannels, channel);
  return found == kPressChannels.end()
             ? nullptr
             : &kProbeChannels[static_cast<std::size_t>(found - kPressChannels.begin())];
}

/// A column that the model does not use.
CsvColumn further_column(std::string name) {
  return {.kind = CsvColumn::Kind::kValue, .name = std::move(name), .channel = named_channel(0)};
}
bool is_further(const CsvColumn& column) noexcept {
  return column.kind == CsvColumn::Kind::kSkip ||
         (column.kind == CsvColumn::Kind::kValue && is_named(column.channel));
}

}  // namespace

/// A column by its name and unit: "force_g". Any other name is an extra column; one in volts or
/// counts gets the name of its unit.
Expected<CsvColumn, SetupError> TraceReader::column_named(const std::string& name) {
  auto named = csv_column_named(name, factors_);
  if (!named && is_electrical_press(name)) return bad_input(lines_.where() + named.error());
  if (!named) return further_column(name);
  const std::size_t mark = name.rfind('_') + 1;
  const auto unit = unit_named(name.substr(mark));
  const bool electrical = unit && unit->is_electrical();
  factors_used_ = factors_used_ || electrical;
  if (named->kind == CsvColumn::Kind::kTime) return std::move(*named);
  CsvColumn further = further_column(name);
  if (named->kind != CsvColumn::Kind::kValue) return further;
  if (is_named(named->channel)) {
    if (!electrical) return further;
    further.name.replace(mark, std::string::npos, unit_of(named->quantity));
    further.set_factor(named->factor);
    return further;
  }
  const SampleChannel* channel = sample_channel_of(named->channel);
  if (channel == nullptr) return further;
  named->power -= channel->power;
  return std::move(*named);
}

/// Whether another column has its meaning.
bool TraceReader::has(const CsvColumn& column) const noexcept {
  return std::any_of(columns_.begin(), columns_.end(), [&](const CsvColumn& other) {
    return other.kind == column.kind &&
           (column.kind == CsvColumn::Kind::kTime || other.channel == column.channel);
  });
}

Expected<TraceReader, SetupError> TraceReader::open(const std::string& path, UnitFactors factors) {
  auto lines = LineReader::open(path);
  if (!lines) return Unexpected<SetupError>(lines.error());
  TraceReader reader(std::move(*lines), std::move(factors));
  if (auto header = reader.read_header(); !header) {
    return Unexpected<SetupError>(header.error());
  }
  return reader;
}

Expected<void, SetupError> TraceReader::read_header() {
  LineReader::Outcome outcome = LineReader::Outcome::kEnd;
  do {
    outcome = lines_.next();
    if (outcome == LineReader::Outcome::kLine) read_comment(lines_.line());
  } while (outcome == LineReader::Outcome::kLine &&
           (lines_.line().empty() || lines_.line().front() == '#'));
  if (outcome == LineReader::Outcome::kError) return bad_input(lines_.error());
  if (outcome == LineReader::Outcome::kEnd) {
    return bad_input(lines_.path() +
                     " is empty: a trace begins with a header such as time_s,depth_mm");
  }
  std::string_view rest = lines_.line();
  if (rest.find(',') == std::string_view::npos &&
      rest.find_first_of(";\t") != std::string_view::npos) {
    return bad_input(lines_.where() +
                     "the columns are not separated by commas: separate them by commas, and write "
                     "decimals with a point, as in 0.001,1.5");
  }
  if (parse_number(rest.substr(0, rest.find(',')))) {
    return bad_input(
        lines_.where() +
        "the first line has numbers where the columns' names belong: add a header such "
        "as time_s,depth_mm");
  }
  while (!rest.empty()) {
    if (auto added = add_column(std::string(take_field(rest))); !added) return added;
  }
  if (!factors_.empty() && !factors_used_) {
    return bad_input(lines_.where() +
                     "no column is in V, mV or counts that a key such as force_N_per_V is for: "
                     "remove it, or name the column with its unit, such as force_V");
  }
  if (auto chosen = choose_taxels(); !chosen) return chosen;
  const std::string extra = listed_extra_columns();
  const std::string unused = extra.empty() ? "" : "the model does not use " + extra;
  const std::string hint = extra.empty() ? "" : "; " + unused;
  if (!has({.kind = CsvColumn::Kind::kTime})) {
    return bad_input(
        lines_.where() +
        "the column time_s is missing: add the times, in seconds (or time_ms, time_us)" + hint);
  }
  const auto is_reading = [](const std::string& column) {
    const auto named = csv_column_named(column);
    return named && named->kind == CsvColumn::Kind::kValue;
  };
  // A single one is rather a misspelt depth or force.
  const bool readings = std::count_if(extra_columns_.begin(), extra_columns_.end(), is_reading) > 1;
  if ((channels_ & (ProbeSample::kDepth | ProbeSample::kForce)) == 0U && !readings &&
      taxels_.empty()) {
    return bad_input(lines_.where() +
                     "a column depth_mm or force_N is missing: add the recorded one; other units "
                     "are named like force_g and depth_um" +
                     hint);
  }
  if (!extra.empty() && channels_ != 0U) {
    notices_.push_back(lines_.path() + ": " + unused + ", which sessions keep");
  }
  if (!ignored_columns_.empty()) {
    std::string sentence = lines_.path() + ": besides the columns of the model, at most " +
                           std::to_string(ProbeColumns::kMaxFurther) +
                           " are kept; these are ignored:";
    for (const std::string& name : ignored_columns_) sentence += " " + name;
    notices_.push_back(std::move(sentence));
  }
  return {};
}

/// The extra columns, each with the nearest known name.
std::string TraceReader::listed_extra_columns() const {
  return listed(extra_columns_, [](const std::string& name) {
    const std::string nearest = nearest_name(name, kColumnNames);
    const auto quantity = [](std::string_view text) { return text.substr(0, text.rfind('_')); };
    const auto column = csv_column_named(name);
    if (!column && quantity(name) == quantity(nearest)) {
      return name + " (" + column.error() + ")";  // of the same quantity, in another unit
    }
    return nearest.empty() ? name : name + " (did you mean " + nearest + "?)";
  });
}

Expected<void, SetupError> TraceReader::add_column(const std::string& name) {
  auto column = column_named(name);
  if (!column) return Unexpected<SetupError>(column.error());
  const auto is_name = [&](const CsvColumn& other) { return other.name == column->name; };
  if (std::any_of(columns_.begin(), columns_.end(), is_name)) {
    return bad_input(lines_.where() + "the column " + name + " is repeated: keep one");
  }
  if (is_further(*column) || has(*column)) {
    add_extra_column(is_further(*column) ? std::move(*column) : further_column(name));
    return {};
  }
  if (column->kind == CsvColumn::Kind::kValue) {
    channels_ |= sample_channel_of(column->channel)->bit;
  }
  columns_.push_back(std::move(*column));
  return {};
}

void TraceReader::add_extra_column(CsvColumn column) {
  const bool kept = extra_columns_.size() < ProbeColumns::kMaxFurther;
  column.kind = kept ? CsvColumn::Kind::kValue : CsvColumn::Kind::kSkip;
  column.channel = named_channel(extra_columns_.size());
  columns_.push_back(column);
  (kept ? extra_columns_ : ignored_columns_)
      .push_back(printable_text(column.name.empty() ? "column_" + std::to_string(columns_.size())
                                                    : column.name));
}

/// Takes pressures as the taxels of an array if there are more of them than further columns.
Expected<void, SetupError> TraceReader::choose_taxels() {
  const auto pressure = [](const CsvColumn& column) {
    const auto named = csv_column_named(column.name);
    return is_further(column) && named && named->quantity == Quantity::kPressure;
  };
  const auto count = std::count_if(columns_.begin(), columns_.end(), pressure);
  if (static_cast<std::size_t>(count) <= ProbeColumns::kMaxFurther) return {};
  if (static_cast<std::size_t>(count) > TaxelArray::kMax) {
    return bad_input(lines_.where() + std::to_string(count) +
                     " columns are pressures, but a tactile array has at most " +
                     std::to_string(TaxelArray::kMax) + " taxels: remove some");
  }
  extra_columns_.clear();
  ignored_columns_.clear();
  for (CsvColumn& column : std::exchange(columns_, {})) {
    if (pressure(column)) {
      column.kind = CsvColumn::Kind::kValue;
      column.channel = named_channel(ProbeColumns::kMaxFurther + taxels_.size());
      column.set_factor(column.factor * csv_column_named(column.name)->factor);
      taxels_.push_back(column.name);
    } else if (is_further(column)) {
      add_extra_column(std::move(column));
      continue;
    }
    columns_.push_back(std::move(column));
  }
  gaps_.resize(taxels_.size());
  return {};
}

void TraceReader::read_comment(std::string_view line) {
  const auto read_ns = [line](std::string_view name, std::optional<std::int64_t>& value) {
    if (!line.starts_with(name)) return;
    const auto number = parsed_number<std::int64_t>(line.substr(name.size()));
    if (number && *number > -kLatestTraceTime_ns && *number < kLatestTraceTime_ns) value = number;
  };
  read_ns(kTraceStart, start_device_ns_);
  read_ns(kTraceOffset, time_offset_ns_);
  if (line == kZeroComment) touch_ = Touch::kZeroed;
  if (!line.starts_with(kValidityComment)) return;
  const auto time = parse_seconds(line.substr(kValidityComment.size()));
  if (time && time->count() >= 0) valid_for_ = *time;
}

std::optional<std::chrono::nanoseconds> TraceReader::start() const noexcept {
  if (!start_device_ns_ || !time_offset_ns_ || !first_time_) return std::nullopt;
  const std::chrono::nanoseconds start{*start_device_ns_ - *time_offset_ns_};
  const double since_ns =
      static_cast<double>(first_time_->count()) - static_cast<double>(start.count());
  if (std::fabs(since_ns) > kTraceBeginning_ns) return std::nullopt;
  return start;
}

std::optional<RecordedRun> TraceReader::run() const {
  const auto start = this->start();
  return start ? std::optional(RecordedRun{.start = *start}) : std::nullopt;
}

/// Why a value of the row cannot be used; empty: it can.
std::string TraceReader::fault_of(const CsvColumn& column, std::string_view field) const {
  if (column.kind == CsvColumn::Kind::kTime) {
    const auto& time = reading_.device_time;
    if (reading_.wrong_time) {
      return std::isfinite(parse_number(field).value_or(HUGE_VAL))
                 ? "beyond ±4e9 s: check its unit"
                 : "not a finite time: correct or remove this row";
    }
    if (rows_ == 0 || *time > last_time_) return {};
    return *time == last_time_
               ? "the same time as in the previous row (resolution: 1 ns): remove one"
               : "earlier than " + shortest_decimal(units::s_from(last_time_)) +
                     " in the previous row: sort the rows by time, or correct the wrong one";
  }
  if (is_further(column)) return {};
  const double value = reading_[column.channel];
  if (!std::isfinite(value)) return "not finite: correct or remove this row";
  const bool force = column.channel == DeviceChannel::kForce;
  const double limit = force                                     ? SampleLimits::kForce_mN
                       : column.channel == DeviceChannel::kDepth ? SampleLimits::kDepth_mm
                                                                 : SampleLimits::kPosition_mm;
  if (plausible(value, limit)) return {};
  return "beyond ±" + shortest_decimal(force ? units::N_from_mN(limit) : limit) +
         (force ? " N" : " mm") + ": check its unit";
}

std::string TraceReader::read_fields() {
  std::string_view rest = lines_.line();
  std::optional<std::uint32_t> number;
  for (const CsvColumn& column : columns_) {
    const std::string_view field = take_field(rest);
    const bool read = read_csv_column(column, field, CsvNumbers::kPlain, reading_, number);
    const std::string fault =
        read ? fault_of(column, field)
             : (column.kind == CsvColumn::Kind::kTime ? "not a finite time" : "not a number") +
                   std::string(": correct or remove this row");
    if (!fault.empty()) return column.name + " is \"" + std::string(field) + "\", " + fault;
    if (!text_reported_ && column.kind == CsvColumn::Kind::kValue && is_further(column) &&
        !field.empty() && std::isnan(reading_[column.channel]) && !parse_number(field)) {
      text_reported_ = true;
      notices_.push_back(lines_.where() + printable_text(column.name) +
                         " is text: sessions keep NaN in its place");
    }
  }
  return {};
}

Expected<void, SetupError> TraceReader::parse_row(ReadingHead& head, std::span<double> row) {
  const std::string_view line = lines_.line();
  const auto fields = static_cast<std::size_t>(std::count(line.begin(), line.end(), ',')) + 1;
  if (fields != columns_.size()) {
    return bad_input(lines_.where() + "this row has " + std::to_string(fields) +
                     (fields == 1 ? " field, but" : " fields, but") + " the header has " +
                     std::to_string(columns_.size()) + ": complete or remove it");
  }
  if (const std::string fault = read_fields(); !fault.empty()) {
    return bad_input(lines_.where() + fault);
  }
  last_time_ = *reading_.device_time;
  if (rows_ == 0) first_time_ = last_time_;
  ProbeSample sample{.time = last_time_,
                     .arrival = last_time_,
                     .sequence = rows_++,
                     .channels = channels_,
                     .valid_for = valid_for_,
                     .touch = touch_};
  for (std::size_t i = 0; i < kPressChannels.size(); ++i) {
    if (kProbeChannels[i].in(channels_))
      sample.*kProbeChannels[i].member = reading_[kPressChannels[i]];
  }
  head = head_of(sample);
  const ProbeColumns places = columns();
  places.put(sample, row);
  const std::span<double> further = places.further_in(row);
  for (std::size_t i = 0; i < further.size(); ++i) further[i] = reading_[named_channel(i)];
  const std::span<double> pressures = places.taxels_in(row);
  for (std::size_t i = 0; i < pressures.size(); ++i) {
    const double kPa = gaps_[i].take(reading_[named_channel(ProbeColumns::kMaxFurther + i)]);
    // In single precision, as the records of pressures are.
    pressures[i] = kPa > 0.0 && kPa <= SampleLimits::kPressure_kPa
                       ? static_cast<double>(static_cast<float>(kPa))
                       : 0.0;
  }
  return {};
}

/// False at the end.
Expected<bool, SetupError> TraceReader::next_row(ReadingHead& head, std::span<double> row) {
  for (;;) {
    switch (lines_.next()) {
      case LineReader::Outcome::kError:
        return bad_input(lines_.error());
      case LineReader::Outcome::kEnd:
        return false;
      case LineReader::Outcome::kLine:
        break;
    }
    read_comment(lines_.line());
    if (lines_.line().empty() || lines_.line().front() == '#') continue;
    if (auto parsed = parse_row(head, row); !parsed) return Unexpected<SetupError>(parsed.error());
    return true;
  }
}

Expected<std::size_t, SetupError> TraceReader::read(Readings& readings, std::size_t most) {
  for (std::size_t count = 0; count < most; ++count) {
    const std::span<double> row = readings.add({});
    const auto read = next_row(readings.head(readings.size() - 1), row);
    if (read && *read) continue;
    readings.resize(readings.size() - 1);
    if (!read) return Unexpected<SetupError>(read.error());
    return count;
  }
  return most;
}

Expected<std::size_t, SetupError> TraceReader::read(std::span<ProbeSample> samples) {
  Readings readings(ReadingColumns(columns()), samples.size());
  if (auto count = read(readings, samples.size()); !count) return count;
  for (std::size_t i = 0; i < readings.size(); ++i) samples[i] = *readings.sample(i);
  return readings.size();
}

std::string pressure_text(float kPa) {
  std::array<char, 64> digits{};
  const auto [end, error] =
      std::to_chars(digits.data(), digits.data() + digits.size(), kPa, std::chars_format::fixed);
  return {digits.data(), error == std::errc{} ? end : digits.data()};
}

}  // namespace merkel
