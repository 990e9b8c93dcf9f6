#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "drivers/files/csv_text.hpp"
#include "drivers/printable_text.hpp"
#include "drivers/protocols/csv_columns.hpp"
#include "drivers/protocols/csv_text_style.hpp"
#include "drivers/protocols/frame_lines.hpp"
#include "drivers/protocols/line_protocol.hpp"
#include "drivers/protocols/protocol_makers.hpp"
#include "drivers/protocols/row_names.hpp"
#include "drivers/protocols/row_order.hpp"
#include "drivers/protocols/text_row.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

struct CsvOptions {
  std::vector<CsvColumn> columns;
  UnitFactors factors;
  std::optional<CsvStyle> style;
  std::size_t frame_lines = 0;
  unsigned sequence_bits = 32;
  unsigned clock_bits = 32;
  double rate_Hz = 0.0;  ///< 0: unknown
};

class CsvLines final : public LineProtocol {
 public:
  explicit CsvLines(CsvOptions options)
      : order_(options.sequence_bits),
        clock_bits_(options.clock_bits),
        rate_Hz_(options.rate_Hz),
        style_(options.style),
        style_is_given_(options.style.has_value()),
        names_(std::move(options.columns), std::move(options.factors)) {
    if (options.frame_lines > 0) {
      frames_.emplace(options.frame_lines);
      lines_.keep_empty_lines();
    }
    note_columns();
  }

  void begin(nanoseconds /*now*/, DeviceStream& stream) override {
    lines_.reset(true);
    may_be_cut_ = !frames_ && !stream.from_start;
    if (frames_) frames_->reset();
    order_.reopened();
    unread_.clear();
  }

  /// What was sent while nobody read is not lost.
  void start(nanoseconds /*now*/, DeviceStream& /*stream*/) override { order_.forget(); }

  [[nodiscard]] std::string expected(std::string_view answer) const override {
    if (answer.size() >= LineSplitter::kMaxLine) {
      return "lines of less than " + std::to_string(LineSplitter::kMaxLine) + " bytes";
    }
    if (answer.empty()) return "a newline after each line, and " + expected_in(answer);
    const std::string advice = is_text(answer) ? csv_advice({std::string(answer)}) : "";
    return expected_in(answer) + (advice.empty() ? "" : ": ") + advice;
  }
  [[nodiscard]] std::uint32_t channels() const noexcept override { return channels_; }
  [[nodiscard]] bool ready() const noexcept override { return measures_; }
  [[nodiscard]] std::vector<ChannelName> channel_names() const override {
    return names_.channels();
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

  [[nodiscard]] std::string expected_in(std::string_view answer) const {
    const std::size_t columns = names_.layout().size();
    if (columns == 0) return "lines of numbers";
    const std::string list = names_.list();
    if (names_.in_rows()) return "lines that name " + list;
    const auto values = [](std::size_t count) {
      return std::to_string(count) + (count == 1 ? " value" : " values");
    };
    const std::string where =
        frames_ ? "frames of " + std::to_string(frames_->lines()) + " lines" : "a line";
    std::vector<CsvStyle> styles = csv_styles({std::string(answer)});
    if (style_) styles.assign(1, *style_);
    std::size_t count = 0;
    if (!styles.empty() && !frames_) count = csv_cells_of(answer, styles.front().separator).size();
    return values(columns) + " in " + where + " (" + list + ")" +
           (count == columns || count == 0 ? "" : ", but this one has " + values(count));
  }

  /// A header that differs from the one before.
  struct NewHeader {
    RowNames names;
    std::string notice;
    char separator;
  };

  void note_columns() {
    const std::vector<ChannelName> channels = names_.channels();
    channels_ = 0;
    for (const ChannelName& each : channels) channels_ |= bit_of(each.channel);
    measures_ = std::ranges::any_of(
        channels, [](const ChannelName& each) { return each.quantity != Quantity::kSync; });
    error_message_ = names_.error_message();
    wrap_.reset();
    for (const CsvColumn& column : names_.columns()) {
      if (column.kind == CsvColumn::Kind::kTime && column.nanoseconds < 1'000'000'000) {
        wrap_ = nanoseconds{(std::int64_t{1} << clock_bits_) * column.nanoseconds};
      }
    }
  }

  /// Lines cannot be read: for that reason, unless a column lacks its factor.
  void fail(const std::string& reason) {
    error_message_ = names_.error_message().empty() ? reason : names_.error_message();
  }

  void read_line(std::string_view line, nanoseconds arrival, DeviceStream& stream) override {
    if (!frames_) {
      read_row(line, arrival, stream);
      return;
    }
    switch (frames_->take(line)) {
      case FrameLines::Result::kNone:
        break;
      case FrameLines::Result::kDamaged:
        ++stream.counts.damaged;
        break;
      case FrameLines::Result::kNeverSeparated:
        error_message_ = "nothing separates its frames of " + std::to_string(frames_->lines()) +
                         " lines: let it print an empty line after each";
        break;
      case FrameLines::Result::kFrame:
        read_row(frames_->row(), arrival, stream);
        break;
    }
  }

  void read_row(std::string_view line, nanoseconds arrival, DeviceStream& stream) {
    const bool cut = std::exchange(may_be_cut_, false);
    line = without_byte_order_mark(line);
    if (line.empty() || line.front() == '#') return;
    if (line.find_first_not_of(" \t") == std::string_view::npos) return;
    const bool digits = line.find_first_of("0123456789") != std::string_view::npos;
    if (!known_ && (line.front() == '{' || line.front() == '[')) {
      units_.clear();
      if (read_json_row(line, row_)) {
        json_ = read_named(line, false, arrival, stream) || json_;
      } else if (!cut) {
        ++stream.counts.damaged;
      }
      return;
    }
    if (json_) {
      if (digits && !cut) ++stream.counts.damaged;
      return;
    }
    if (read_header(line, cut, stream)) {
      ++stream.counts.frames;
      return;
    }
    if (cut) return;
    if (new_header_) check_new_header(line, stream);
    if (known_ || (names_.known() && suits(line))) {
      known_ = true;
      read_numbers(line, arrival, stream);
      return;
    }
    if (!digits) return;
    unread_.emplace_back(std::string(line), arrival);
    if (unread_.size() >= kLearnFrom) learn(stream);
  }

  /// Reads row_, which names its values, or is a list. False if nothing in it is measured.
  bool read_named(std::string_view line, bool decimal_comma, nanoseconds arrival,
                  DeviceStream& stream) {
    const auto named =
        row_.names.empty() ? std::optional(false) : names_.take_row(row_.names, units_);
    if (named.value_or(false)) note_columns();
    if (!named || !measures_) {
      ++stream.counts.frames;
      if (!measures_ && ++unnamed_ == kLearnFrom) fail(csv_unnamed(line, row_));
      return false;
    }
    parts_.assign(row_.values.begin(), row_.values.end());
    read_parts(decimal_comma, arrival, stream);
    return true;
  }

  /// A header names all columns. One that changes them is obeyed once a row fits it: noise may look
  /// like a header.
  bool read_header(std::string_view line, bool cut, DeviceStream& stream) {
    if (names_.in_rows() || parse_csv_field(line, false).number) return false;
    for (const char separator : {',', ';', '\t', ' '}) {
      if (style_is_given_ && style_->separator != separator) continue;
      NewHeader next{.names = names_, .notice = {}, .separator = separator};
      const RowNames::Header header = next.names.take_header(csv_cells_of(line, separator), cut);
      if (!header.is_one) continue;
      next.notice = header.notice;
      if (!header.changed) {
        order_.header();
      } else if (known_ && !header.notice.empty()) {
        new_header_ = std::move(next);
      } else {
        use(std::move(next), stream);
      }
      return true;
    }
    return false;
  }

  void use(NewHeader header, DeviceStream& stream) {
    names_ = std::move(header.names);
    order_.header();
    note_columns();
    if (!header.notice.empty()) {
      stream.notice(header.notice);
      stream.columns_changed = true;
    }
    if (!style_is_given_ && (!style_ || style_->separator != header.separator)) {
      style_.reset();
      known_ = false;
      separator_of_header_ =
          names_.layout().size() > 1 ? std::optional(header.separator) : std::nullopt;
    }
  }

  /// Obeys the new header if a row fits it, or forgets it.
  void check_new_header(std::string_view line, DeviceStream& stream) {
    NewHeader next = *std::exchange(new_header_, std::nullopt);
    split(line, next.separator, next.names);
    DeviceReading reading;
    std::optional<std::uint32_t> number;
    // A new separator may come with another decimal sign.
    const bool same = style_ && style_->separator == next.separator;
    const bool comma = style_ && style_->decimal_comma;
    if (read_fields(next.names, comma, reading, number) ||
        (!same && next.separator != ',' && read_fields(next.names, !comma, reading, number))) {
      use(std::move(next), stream);
    }
  }

  /// Into the columns of `names`.
  void split(std::string_view line, char separator, const RowNames& names) {
    parts_.clear();
    const bool may_end_empty = ends_in_separator(line, separator);
    while (!line.empty() && parts_.size() < TextRow::kMaxValues) {
      parts_.push_back(take_csv_part(line, separator));
    }
    if (may_end_empty && parts_.size() + 1 == names.layout().size()) parts_.emplace_back();
  }

  /// True if a line has the named columns in the given style or the default style.
  bool suits(std::string_view line) {
    const CsvStyle style =
        style_.value_or(CsvStyle{.separator = separator_of_header_.value_or(',')});
    DeviceReading reading;
    std::optional<std::uint32_t> number;
    const bool marks = line.find_first_of(":=") != std::string_view::npos;
    if (marks && read_labelled_row(line, style, row_, units_)) return false;  // learn() does
    split(line, style.separator, names_);
    if (!style_ && !read_fields(names_, style.decimal_comma, reading, number)) return false;
    style_ = style;
    return true;
  }

  /// Learns the style of the lines, and their columns if the lines name them.
  void learn(DeviceStream& stream) {
    std::vector<std::string> lines;
    for (const auto& [line, arrival] : unread_) lines.push_back(line);
    bool learned = false;
    for (const CsvStyle& style : style_ ? std::vector{*style_} : csv_styles(lines)) {
      if (are_labelled(lines, style)) {
        style_ = style;
        labelled_ = learned = true;
        break;
      }
      split(lines.back(), style.separator, names_);
      if (names_.known() ? names_.layout().size() != parts_.size()
                         : !take_units(lines.back(), style)) {
        continue;
      }
      style_ = style;
      learned = true;
      break;
    }
    if (!learned) {
      if (names_.known()) {
        stream.counts.damaged += unread_.size();
      } else {
        fail(csv_unnamed(lines.back(), {}));
      }
      unread_.clear();
      return;
    }
    error_message_ = names_.error_message();
    known_ = true;
    for (const auto& [line, arrival] : std::exchange(unread_, {})) {
      read_numbers(line, arrival, stream);
    }
  }

  /// True if all numbers of the lines have labels, the same in each line.
  static bool are_labelled(const std::vector<std::string>& lines, const CsvStyle& style) {
    TextRow first;
    TextRow row;
    std::vector<std::string> units;
    for (const std::string& line : lines) {
      if (!read_labelled_row(line, style, row, units)) return false;
      if (first.names.empty()) first = row;
      if (row.names != first.names) return false;
    }
    return true;
  }

  /// Columns by the units beside the numbers of a line; false if none measures.
  bool take_units(const std::string& line, const CsvStyle& style) {
    std::vector<std::string> labels;
    std::vector<std::string> units;
    for (const CsvField& field : csv_fields_of(line, style)) {
      labels.emplace_back(field.number ? field.label : "");
      units.emplace_back(field.number ? field.unit : "");
    }
    if (!names_.take_columns(csv_columns_of_labels(labels, units))) return false;
    note_columns();
    return measures_;
  }

  bool read_fields(const RowNames& names, bool decimal_comma, DeviceReading& reading,
                   std::optional<std::uint32_t>& number) const {
    const std::vector<std::size_t>& layout = names.layout();
    if (parts_.size() != layout.size()) return false;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      if (layout[i] == RowNames::kIgnored) continue;
      if (!read_csv_column(names.column(layout[i]), parts_[i],
                           decimal_comma ? CsvNumbers::kDecimalComma : CsvNumbers::kPoint, reading,
                           number)) {
        return false;
      }
    }
    return true;
  }

  void read_numbers(std::string_view line, nanoseconds arrival, DeviceStream& stream) {
    if (!labelled_) {
      split(line, style_->separator, names_);
      read_parts(style_->decimal_comma, arrival, stream);
    } else if (read_labelled_row(line, *style_, row_, units_)) {
      static_cast<void>(read_named(line, style_->decimal_comma, arrival, stream));
    } else {
      ++stream.counts.damaged;
    }
  }

  void read_parts(bool decimal_comma, nanoseconds arrival, DeviceStream& stream) {
    DeviceReading reading;
    reading.arrival = arrival;
    std::optional<std::uint32_t> number;
    if (!read_fields(names_, decimal_comma, reading, number)) {
      ++stream.counts.damaged;
      return;
    }
    ++stream.counts.frames;
    if (order_.take(reading, number, wrap_, stream)) stream.accept(reading);
  }

  RowOrder order_;
  unsigned clock_bits_;
  double rate_Hz_;
  std::optional<CsvStyle> style_;
  bool style_is_given_;
  std::optional<char> separator_of_header_;
  std::optional<NewHeader> new_header_;                      ///< no row has confirmed it yet
  std::vector<std::pair<std::string, nanoseconds>> unread_;  ///< until their style is known
  RowNames names_;
  std::optional<FrameLines> frames_;
  TextRow row_;  ///< the present one, if it has names
  std::vector<std::string> units_;
  std::vector<std::string_view> parts_;  ///< of the present row
  std::uint32_t channels_ = 0;
  bool measures_ = false;
  std::string error_message_;
  std::optional<nanoseconds> wrap_;
  bool known_ = false;     ///< style and columns
  bool labelled_ = false;  ///< each number has a label
  bool json_ = false;
  std::size_t unnamed_ = 0;  ///< rows in which nothing is measured
  bool may_be_cut_ = true;
};

}  // namespace

Expected<std::unique_ptr<Protocol>, SetupError> make_csv_lines(UriOptions& options) {
  CsvOptions csv;
  auto factors = UnitFactors::from(options);
  if (!factors) return Unexpected<SetupError>(factors.error());
  csv.factors = std::move(*factors);
  const std::string names = options.text("columns", "");
  const std::string separator = options.word("separator", "auto", "auto|comma|semicolon|tab|space");
  const std::string decimal = options.word("decimal", "auto", "auto|point|comma");
  csv.frame_lines = static_cast<std::size_t>(options.whole("frame_lines", 0, 2, 1024));
  csv.sequence_bits = static_cast<unsigned>(options.whole("seq_bits", 32, 4, 32));
  csv.clock_bits = static_cast<unsigned>(options.whole("clock_bits", 32, 8, 32));
  csv.rate_Hz = options.number("rate_hz", 0.0, 0.01, 100'000.0);
  if (!names.empty()) {
    auto named = csv_columns_named(names, ',', csv.factors);
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
    if (line && is_line_of_numbers(*line)) ++count;
  }
  return count;
}

}  // namespace merkel
