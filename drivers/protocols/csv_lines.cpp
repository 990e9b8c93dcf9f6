#include "drivers/protocols/csv_lines.hpp"

#include <cmath>
#include <string>

#include "core/parameters/nearest_name.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/units.hpp"
#include "drivers/files/csv_text.hpp"
#include "drivers/protocols/device_units.hpp"
#include "drivers/protocols/line_protocol.hpp"
#include "drivers/protocols/sequence_counter.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

constexpr nanoseconds kNoise{2'000'000};  ///< by how much a device's clock may seem to go back

struct Column {
  enum class Kind : std::uint8_t { kSkip, kTime, kSequence, kValue };
  Kind kind = Kind::kSkip;
  DeviceChannel channel = DeviceChannel::kForce;
  double factor = 1.0;           ///< to N or mm
  std::int64_t nanoseconds = 0;  ///< of one unit of time
};

std::string_view trimmed(std::string_view text) noexcept {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

/// What a column's name means; or a sentence.
Expected<Column, std::string> column_named(std::string_view name) {
  if (name == "-") return Column{};
  if (name == "seq") return Column{.kind = Column::Kind::kSequence};
  const auto mark = name.rfind('_');
  const std::string_view stem = name.substr(0, mark);
  const std::string_view unit = mark == std::string_view::npos ? "" : name.substr(mark + 1);
  if (stem == "time") {
    for (const auto& [known, ns] : {std::pair<std::string_view, std::int64_t>{"s", 1'000'000'000},
                                    {"ms", 1'000'000},
                                    {"us", 1'000}}) {
      if (unit == known) return Column{.kind = Column::Kind::kTime, .nanoseconds = ns};
    }
    return Unexpected<std::string>("the unit of " + std::string(name) +
                                   " is not known: time is in s, ms or us");
  }
  for (std::size_t i = 0; i < kDeviceChannels; ++i) {
    if (stem != kDeviceChannelNames[i]) continue;
    const auto channel = static_cast<DeviceChannel>(i);
    const bool force = channel <= DeviceChannel::kForceZ;
    const auto factor = force ? newtons_per(unit) : millimetres_per(unit);
    if (!factor) {
      return Unexpected<std::string>("the unit of " + std::string(name) + " is not known: " +
                                     (force ? "forces are in " + std::string(kForceUnits)
                                            : "lengths are in " + std::string(kLengthUnits)));
    }
    return Column{.kind = Column::Kind::kValue, .channel = channel, .factor = *factor};
  }
  return Unexpected<std::string>(
      "the column " + std::string(name) +
      " is not known: known are time_s, time_ms, time_us, seq, force_N, force_x_N, force_y_N, "
      "force_z_N, depth_mm, x_mm, y_mm, z_mm with their units, and - for none");
}

std::string_view take_part(std::string_view& rest, char separator) noexcept {
  const std::string_view part = rest.substr(0, rest.find(separator));
  rest.remove_prefix(std::min(part.size() + 1, rest.size()));
  return trimmed(part);
}

Expected<std::vector<Column>, std::string> columns_named(std::string_view names, char separator) {
  std::vector<Column> columns;
  std::uint32_t channels = 0;
  std::string_view rest = names;
  while (!rest.empty()) {
    auto column = column_named(take_part(rest, separator));
    if (!column) return Unexpected<std::string>(column.error());
    if (column->kind == Column::Kind::kValue) channels |= bit_of(column->channel);
    columns.push_back(*column);
  }
  if (channels == 0U) {
    return Unexpected<std::string>(
        "no column is a force, a depth or a position: name one, for example force_N");
  }
  return columns;
}

class CsvLines final : public LineProtocol {
 public:
  CsvLines(std::vector<Column> columns, char separator, unsigned sequence_bits, unsigned clock_bits)
      : separator_(separator), sequence_(sequence_bits), clock_bits_(clock_bits) {
    use(std::move(columns));
  }

  void begin(nanoseconds /*now*/, DeviceStream& /*stream*/) override {
    lines_.reset(columns_.empty());  // a header may be the very first line
  }

  [[nodiscard]] std::uint32_t channels() const noexcept override { return channels_; }
  [[nodiscard]] std::optional<nanoseconds> clock_wrap() const noexcept override { return wrap_; }

 private:
  void use(std::vector<Column> columns) {
    columns_ = std::move(columns);
    channels_ = 0;
    wrap_.reset();
    for (const Column& column : columns_) {
      if (column.kind == Column::Kind::kValue) channels_ |= bit_of(column.channel);
      if (column.kind == Column::Kind::kTime && column.nanoseconds < 1'000'000'000) {
        wrap_ = nanoseconds{(std::int64_t{1} << clock_bits_) * column.nanoseconds};
      }
    }
  }

  void read_line(std::string_view whole, nanoseconds arrival, DeviceStream& stream) override {
    const std::string_view line = trimmed(whole);
    if (line.empty() || line.front() == '#') return;
    if (columns_.empty()) {
      if (auto columns = columns_named(line, separator_)) {
        use(std::move(*columns));
        ++stream.counts.frames;
      }
      return;
    }
    DeviceReading reading;
    reading.arrival = arrival;
    std::optional<std::uint32_t> number;
    std::string_view rest = line;
    std::size_t i = 0;
    for (; i < columns_.size() && !rest.empty(); ++i) {
      const std::string_view part = take_part(rest, separator_);
      if (!read_part(columns_[i], part, reading, number)) break;
    }
    if (i < columns_.size() || !rest.empty()) {
      // A header again, in the middle of numbers: it has started anew.
      if (columns_named(line, separator_)) {
        restarted_ = true;
        ++stream.counts.frames;
      } else {
        ++stream.counts.damaged;
      }
      return;
    }
    ++stream.counts.frames;
    if (reading.device_time && restarted(*reading.device_time)) restarted_ = true;
    if (restarted_) {
      sequence_.forget();
      reading.rebooted = true;
      restarted_ = false;
    }
    if (number) {
      const auto step = sequence_.next(*number);
      if (step.duplicate) {
        ++stream.counts.duplicates;
        return;
      }
      reading.lost = step.lost;
      reading.rebooted = reading.rebooted || step.restarted;
    }
    stream.accept(reading);
  }

  static bool read_part(const Column& column, std::string_view part, DeviceReading& reading,
                        std::optional<std::uint32_t>& number) {
    switch (column.kind) {
      case Column::Kind::kSkip:
        return true;
      case Column::Kind::kTime: {
        if (column.nanoseconds == 1'000'000'000) {
          const auto time = parse_seconds(part);
          if (!time || time->count() < 0) return false;
          reading.device_time = *time;
          return true;
        }
        const auto count = parse_number(part);
        if (!count || !(*count >= 0.0 && *count < 9e15 / static_cast<double>(column.nanoseconds))) {
          return false;
        }
        reading.device_time =
            nanoseconds{std::llround(*count * static_cast<double>(column.nanoseconds))};
        return true;
      }
      case Column::Kind::kSequence: {
        const auto count = parse_number(part);
        if (!count || !(*count >= 0.0 && *count <= 4294967295.0) || *count != std::floor(*count)) {
          return false;
        }
        number = static_cast<std::uint32_t>(*count);
        return true;
      }
      case Column::Kind::kValue: {
        const auto value = parse_number(part);
        if (!value) return false;
        reading.set(column.channel, *value * column.factor);
        return true;
      }
    }
    return false;
  }

  /// Whether the device's clock has gone back, otherwise than by its wrap, and stays there: one
  /// wrong time is no restart.
  bool restarted(nanoseconds time) noexcept {
    const bool back =
        last_time_ && time < *last_time_ - kNoise && (!wrap_ || *last_time_ - time < *wrap_ / 2);
    const bool confirmed = back && went_back_;
    went_back_ = back && !confirmed;
    if (!went_back_) last_time_ = time;
    return confirmed;
  }

  char separator_;
  SequenceCounter sequence_;
  unsigned clock_bits_;
  std::vector<Column> columns_;
  std::uint32_t channels_ = 0;
  std::optional<nanoseconds> wrap_;
  std::optional<nanoseconds> last_time_;
  bool went_back_ = false;
  bool restarted_ = false;
};

}  // namespace

Expected<std::unique_ptr<Protocol>, SetupError> make_csv_lines(UriOptions& options) {
  const std::string names = options.text("columns", "");
  const std::string separator = options.word("separator", "comma", "comma|semicolon|tab|space");
  const auto sequence_bits = options.whole("seq_bits", 32, 4, 32);
  const auto clock_bits = options.whole("clock_bits", 32, 8, 32);
  std::vector<Column> columns;
  if (!names.empty()) {
    auto named = columns_named(names, ',');
    if (!named) return bad_input("columns=" + names + ": " + named.error());
    columns = std::move(*named);
  }
  const char mark = separator == "semicolon" ? ';'
                    : separator == "tab"     ? '\t'
                    : separator == "space"   ? ' '
                                             : ',';
  return std::make_unique<CsvLines>(std::move(columns), mark, static_cast<unsigned>(sequence_bits),
                                    static_cast<unsigned>(clock_bits));
}

std::size_t lines_of_numbers(std::span<const std::uint8_t> bytes) {
  LineSplitter lines;
  std::size_t count = 0;
  for (const std::uint8_t byte : bytes) {
    const auto line = lines.take(byte);
    if (!line || line->find_first_of("0123456789") == std::string_view::npos) continue;
    if (line->find_first_not_of("0123456789+-.eE,; \t") == std::string_view::npos) ++count;
  }
  return count;
}

}  // namespace merkel
