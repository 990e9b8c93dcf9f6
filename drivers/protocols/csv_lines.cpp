#include "drivers/protocols/csv_lines.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "drivers/protocols/clock_order.hpp"
#include "drivers/protocols/csv_columns.hpp"
#include "drivers/protocols/csv_text_style.hpp"
#include "drivers/protocols/line_protocol.hpp"
#include "drivers/protocols/sequence_counter.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

constexpr nanoseconds kNoise{2'000'000};  ///< largest step back that is not a restart

struct CsvOptions {
  std::vector<CsvColumn> columns;
  std::optional<CsvStyle> style;
  unsigned sequence_bits = 32;
  unsigned clock_bits = 32;
  double rate_Hz = 0.0;  ///< 0: unknown
};

class CsvLines final : public LineProtocol {
 public:
  explicit CsvLines(CsvOptions options)
      : sequence_(options.sequence_bits),
        clock_bits_(options.clock_bits),
        rate_Hz_(options.rate_Hz),
        style_(options.style) {
    use(std::move(options.columns));
  }

  void begin(nanoseconds /*now*/, DeviceStream& /*stream*/) override {
    lines_.reset(columns_.empty());  // a header may be the first line
    sequence_.reopened();
    unread_.clear();
  }

  /// What was sent while nobody read is not lost.
  void start(nanoseconds /*now*/, DeviceStream& /*stream*/) override { sequence_.forget(); }

  [[nodiscard]] std::string expected(std::string_view answer) const override {
    if (answer.size() >= LineSplitter::kLongestLine) {
      return "lines of less than " + std::to_string(LineSplitter::kLongestLine) + " bytes";
    }
    if (columns_.empty()) return "lines of numbers";
    std::vector<std::string> names;
    for (const CsvColumn& column : columns_)
      names.push_back(column.name.empty() ? "-" : column.name);
    const auto values = [](std::size_t count) {
      return std::to_string(count) + (count == 1 ? " value" : " values");
    };
    std::vector<CsvStyle> styles = csv_styles({std::string(answer)});
    if (style_) styles.assign(1, *style_);
    std::size_t count = 0;
    for (; !styles.empty() && !answer.empty(); ++count) {
      static_cast<void>(take_csv_part(answer, styles.front().separator));
    }
    return values(columns_.size()) + " in a line (" + csv_list_of(names) + ")" +
           (count == columns_.size() || count == 0 ? "" : ", but this one has " + values(count));
  }
  [[nodiscard]] std::uint32_t channels() const noexcept override { return channels_; }
  [[nodiscard]] bool ready() const noexcept override { return measures_; }
  [[nodiscard]] std::vector<ChannelName> channel_names() const override {
    std::vector<ChannelName> names;
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      const CsvColumn& column = columns_[i];
      if (column.kind != CsvColumn::Kind::kValue) continue;
      names.push_back({.name = column.name,
                       .channel = column.channel,
                       .column = i + 1,
                       .force = column.force,
                       .pressure = column.pressure});
    }
    return names;
  }
  [[nodiscard]] const std::string& error_message() const noexcept override {
    return error_message_;
  }
  [[nodiscard]] std::optional<nanoseconds> period() const noexcept override {
    return period_of(rate_Hz_);
  }
  [[nodiscard]] std::optional<nanoseconds> clock_wrap() const noexcept override { return wrap_; }

 private:
  static constexpr std::size_t kLearnFrom = 3;

  void use(std::vector<CsvColumn> columns) {
    columns_ = std::move(columns);
    number_named_channels(columns_);
    channels_ = 0;
    measures_ = false;
    wrap_.reset();
    for (const CsvColumn& column : columns_) {
      if (column.kind == CsvColumn::Kind::kValue) {
        channels_ |= bit_of(column.channel);
        measures_ = true;
      }
      if (column.kind == CsvColumn::Kind::kTime && column.nanoseconds < 1'000'000'000) {
        wrap_ = nanoseconds{(std::int64_t{1} << clock_bits_) * column.nanoseconds};
      }
    }
  }

  void read_line(std::string_view line, nanoseconds arrival, DeviceStream& stream) override {
    if (line.front() == '#' || line.find_first_not_of(" \t") == std::string_view::npos) return;
    if (read_header(line)) {
      restarted_ = restarted_ || known_;
      ++stream.counts.frames;
      return;
    }
    if (known_ || (!columns_.empty() && suits(line))) {
      known_ = true;
      read_numbers(line, arrival, stream);
      return;
    }
    if (line.find_first_of("0123456789") == std::string_view::npos) return;
    unread_.emplace_back(std::string(line), arrival);
    if (unread_.size() >= kLearnFrom) learn(stream);
  }

  /// A header names all columns. A repeated header means that the device has restarted.
  bool read_header(std::string_view line) {
    if (parse_csv_field(line, false).number) return false;
    for (const char separator : {',', ';', '\t', ' '}) {
      if (style_ && style_->separator != separator) continue;
      const std::vector<std::string> names = csv_columns_of_header(line, separator);
      if (names.empty()) continue;
      if (columns_.empty()) {
        use(columns_of(names));
        if (!style_ && columns_.size() > 1) separator_of_header_ = separator;
      }
      return true;
    }
    return false;
  }

  /// True if a line has the named columns in the given style or the default style.
  bool suits(std::string_view line) {
    const char separator = separator_of_header_.value_or(',');
    const CsvStyle style = style_.value_or(CsvStyle{.separator = separator});
    DeviceReading reading;
    std::optional<std::uint32_t> number;
    if (!style_ && !read_fields(line, style, reading, number)) return false;
    style_ = style;
    return true;
  }

  /// Learns the style of the lines, and their columns if the lines name them.
  void learn(DeviceStream& stream) {
    std::vector<std::string> lines;
    for (const auto& [line, arrival] : unread_) lines.push_back(line);
    bool learned = false;
    for (const CsvStyle& style : style_ ? std::vector{*style_} : csv_styles(lines)) {
      std::vector<CsvColumn> columns =
          columns_.empty() ? stated_columns(lines.back(), style) : columns_;
      std::size_t fields = 0;
      for (std::string_view rest = lines.back(); !rest.empty(); ++fields) {
        static_cast<void>(take_csv_part(rest, style.separator));
      }
      if (columns.empty() || columns.size() != fields) continue;
      style_ = style;
      if (columns_.empty()) use(std::move(columns));
      learned = true;
      break;
    }
    if (!learned) {
      if (columns_.empty()) {
        error_message_ = unnamed(lines.back());
      } else {
        stream.counts.damaged += unread_.size();
      }
      unread_.clear();
      return;
    }
    error_message_.clear();
    known_ = true;
    for (const auto& [line, arrival] : std::exchange(unread_, {})) {
      read_numbers(line, arrival, stream);
    }
  }

  /// The columns of a line with labels and units; empty if it has none.
  static std::vector<CsvColumn> stated_columns(const std::string& line, const CsvStyle& style) {
    std::vector<std::string> names;
    const std::vector<CsvField> fields = csv_fields_of(line, style);
    for (const CsvField& field : fields) {
      const std::string name = field.number ? csv_column_of(field) : "-";
      names.push_back(name.empty() ? "-" : name);
    }
    tell_csv_columns_apart(names, fields);
    std::vector<CsvColumn> columns = columns_of(names);
    const bool measures = std::any_of(columns.begin(), columns.end(), [](const CsvColumn& column) {
      return column.kind == CsvColumn::Kind::kValue;
    });
    return measures ? columns : std::vector<CsvColumn>{};
  }

  /// Columns of known names.
  static std::vector<CsvColumn> columns_of(const std::vector<std::string>& names) {
    std::vector<CsvColumn> columns;
    for (const std::string& name : names)
      columns.push_back(csv_column_named(name).value_or(CsvColumn{}));
    return columns;
  }

  static std::string unnamed(const std::string& line) {
    if (line.front() == '{' || line.front() == '[') {
      return "its lines, such as \"" + line +
             "\", are JSON, which is not read: send the numbers alone, separated by commas, after a "
             "header such as time_s,force_N";
    }
    const std::vector<CsvStyle> styles = csv_styles({line});
    const CsvStyle style = styles.empty() ? CsvStyle{',', false} : styles.front();
    // The first number with decimals is the likeliest force; whole numbers count or tell time.
    std::vector<bool> decimals;
    for (std::string_view rest = line; !rest.empty();) {
      const std::string_view part = take_csv_part(rest, style.separator);
      decimals.push_back(part.find(style.decimal_comma ? ',' : '.') != std::string_view::npos);
    }
    const auto first = std::find(decimals.begin(), decimals.end(), true);
    const auto force =
        static_cast<std::size_t>(first == decimals.end() ? 0 : first - decimals.begin());
    std::string names;
    for (std::size_t i = 0; i < decimals.size(); ++i) {
      names += (i == 0 ? "" : ",") + std::string(i == force ? "force_N" : "-");
    }
    return "its lines, such as \"" + line +
           "\", have no labels: run merkel connect, which recognises them, or name the columns and "
           "units, for example columns=" +
           names + " (time_us, seq, depth_mm; - ignores a column)";
  }

  bool read_fields(std::string_view line, const CsvStyle& style, DeviceReading& reading,
                   std::optional<std::uint32_t>& number) const {
    std::string_view rest = line;
    for (const CsvColumn& column : columns_) {
      if (rest.empty()) return false;
      const std::string_view part = take_csv_part(rest, style.separator);
      if (!read_csv_column(column, part, style.decimal_comma, reading, number)) return false;
    }
    return rest.empty();
  }

  void read_numbers(std::string_view line, nanoseconds arrival, DeviceStream& stream) {
    DeviceReading reading;
    reading.arrival = arrival;
    std::optional<std::uint32_t> number;
    if (!read_fields(line, *style_, reading, number)) {
      ++stream.counts.damaged;
      return;
    }
    ++stream.counts.frames;
    if (reading.device_time && clock_.restarted(*reading.device_time, arrival, wrap_)) {
      restarted_ = true;
    }
    if (restarted_) {
      sequence_.forget();
      clock_.forget();
      reading.rebooted = true;
      restarted_ = false;
    }
    if (number) {
      const auto step = sequence_.next(*number, stream);
      if (step.dropped()) {
        restarted_ = reading.rebooted;
        return;
      }
      reading.lost = step.lost;
      reading.rebooted = reading.rebooted || step.restarted;
    }
    stream.accept(reading);
  }

  SequenceCounter sequence_;
  ClockOrder clock_{kNoise};
  unsigned clock_bits_;
  double rate_Hz_;
  std::optional<CsvStyle> style_;
  std::optional<char> separator_of_header_;
  std::vector<std::pair<std::string, nanoseconds>> unread_;  ///< until their style is known
  std::vector<CsvColumn> columns_;
  std::uint32_t channels_ = 0;
  bool measures_ = false;
  std::string error_message_;
  std::optional<nanoseconds> wrap_;
  bool known_ = false;  ///< style and columns
  bool restarted_ = false;
};

}  // namespace

Expected<std::unique_ptr<Protocol>, SetupError> make_csv_lines(UriOptions& options) {
  CsvOptions csv;
  const std::string names = options.text("columns", "");
  const std::string separator = options.word("separator", "auto", "auto|comma|semicolon|tab|space");
  const std::string decimal = options.word("decimal", "auto", "auto|point|comma");
  csv.sequence_bits = static_cast<unsigned>(options.whole("seq_bits", 32, 4, 32));
  csv.clock_bits = static_cast<unsigned>(options.whole("clock_bits", 32, 8, 32));
  csv.rate_Hz = options.number("rate_hz", 0.0, 0.01, 100'000.0);
  if (!names.empty()) {
    auto named = csv_columns_named(names, ',');
    if (!named) return bad_input("columns=" + names + ": " + named.error());
    csv.columns = std::move(*named);
  }
  if (separator != "auto" || decimal != "auto") {
    const bool comma = decimal == "comma";
    csv.style = CsvStyle{.separator = separator == "semicolon" ? ';'
                                      : separator == "tab"     ? '\t'
                                      : separator == "space"   ? ' '
                                      : separator == "comma"   ? ','
                                      : comma                  ? ';'
                                                               : ',',
                         .decimal_comma = comma};
  }
  return std::make_unique<CsvLines>(std::move(csv));
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
