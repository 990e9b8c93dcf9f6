#include "drivers/protocols/csv_text_style.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <utility>

#include "drivers/files/csv_text.hpp"
#include "drivers/take_part.hpp"

namespace merkel {
namespace {

constexpr std::string_view kBlanks = " \t";
constexpr std::string_view kDigits = "0123456789";
constexpr std::string_view kMinusSign = "\u2212";

std::string_view trimmed(std::string_view text, std::string_view blanks = kBlanks) noexcept {
  const auto first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

std::string lower(std::string_view text) {
  std::string low(text);
  for (char& c : low) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return low;
}

/// The start of the number in a field: after the last ':' or '=', if any.
std::size_t number_begins(std::string_view text, bool decimal_comma) noexcept {
  const auto mark = text.find_last_of(":=");
  std::size_t at = mark == std::string_view::npos ? 0 : mark + 1;
  bool in_word = false;  // the digits and points of "F1" and "v1.2" are a part of the name
  for (; at < text.size(); ++at) {
    const char c = text[at];
    const std::string_view next = text.substr(at + 1, 1);
    if (text.substr(at).starts_with(kMinusSign)) return at;
    if ((c == '+' || c == '-') && !next.empty() &&
        (is_digit(next[0]) || next == "." || (next == " " && !in_word))) {
      return at;
    }
    if (!in_word && (is_digit(c) || (c == '.' && !next.empty() && is_digit(next[0])))) return at;
    const bool letter = std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '_';
    in_word = letter || (in_word && (is_digit(c) || c == '.' || (decimal_comma && c == ',')));
  }
  return std::string_view::npos;
}

/// True for a label such as "F=0.1N D": the field holds several numbers.
bool holds_a_number(std::string_view label) noexcept {
  const auto mark = label.find_first_of(":=");
  return mark != std::string_view::npos &&
         label.find_first_of(kDigits, mark) != std::string_view::npos;
}

/// True for a field of text alone, such as "F" or "status".
bool is_label(const CsvField& field) noexcept {
  return !field.number && !field.label.empty() && field.unit.empty() &&
         field.label.find_first_of(kDigits) == std::string_view::npos;
}

/// True for the names of one quantity: force_N and force_g, time_s and time_ms.
bool differ_in_unit(std::string_view a, std::string_view b) {
  const auto mark = a.rfind('_');
  if (mark == std::string_view::npos || a.substr(0, mark + 1) != b.substr(0, b.rfind('_') + 1)) {
    return false;
  }
  const auto unit = unit_named(a.substr(mark + 1));
  const auto other = unit_named(b.substr(mark + 1));
  return a.substr(0, mark) == "time" || (unit && other && unit->quantity == other->quantity);
}

bool is_one_of(std::string_view word, std::initializer_list<std::string_view> words) noexcept {
  return std::find(words.begin(), words.end(), word) != words.end();
}

}  // namespace

std::string_view take_csv_part(std::string_view& rest, char separator) noexcept {
  if (separator == ' ') {
    const std::string_view started = trimmed(rest);
    const std::string_view part = started.substr(0, started.find_first_of(kBlanks));
    rest = trimmed(started.substr(part.size()));
    return part;
  }
  return trimmed(take_part(rest, separator));
}

CsvField parse_csv_field(std::string_view text, bool decimal_comma) noexcept {
  text = trimmed(text);
  const std::size_t begin = number_begins(text, decimal_comma);
  if (begin == std::string_view::npos) {
    const std::string low = text.size() < 8 ? lower(text) : std::string();
    CsvField field{.label = text, .number = std::nullopt, .unit = {}};
    if (low == "nan" || low == "inf" || low == "-inf") field.label = {};
    return field;
  }
  std::array<char, 48> digits{};
  std::size_t length = 0;
  std::size_t at = begin;
  if (text[at] == '+') ++at;
  if (text.substr(at).starts_with(kMinusSign)) {
    at += kMinusSign.size();
    digits[length++] = '-';
  }
  for (bool blank_after_sign = true; at < text.size() && length < digits.size(); ++at) {
    const char c = text[at];
    const bool exponent = (c == 'e' || c == 'E') && length > 0 && at + 1 < text.size() &&
                          (is_digit(text[at + 1]) || text[at + 1] == '-' || text[at + 1] == '+');
    const bool sign = (c == '-' || c == '+') &&
                      (length == 0 || digits[length - 1] == 'e' || digits[length - 1] == 'E');
    if (c == ' ' && length == 1 && digits[0] == '-' && blank_after_sign) continue;  // "-  0.5"
    if (!is_digit(c) && c != '.' && !(decimal_comma && c == ',') && !exponent && !sign) break;
    if (c == '+') continue;
    digits[length++] = c == ',' ? '.' : c;
  }
  CsvField field{
      .label = trimmed(text.substr(0, begin), " \t:="), .number = std::nullopt, .unit = {}};
  double value = 0.0;
  const auto result = std::from_chars(digits.data(), digits.data() + length, value);
  if (result.ec == std::errc{} && result.ptr == digits.data() + length) field.number = value;
  field.unit = trimmed(text.substr(at));
  field.decimals =
      std::find(digits.begin(), digits.begin() + length, '.') != digits.begin() + length;
  return field;
}

std::vector<CsvStyle> csv_styles(const std::vector<std::string>& lines) {
  struct Candidate {
    CsvStyle style;
    double score = 0.0;
  };
  std::vector<Candidate> candidates;
  for (const CsvStyle style :
       {CsvStyle{',', false}, CsvStyle{';', true}, CsvStyle{';', false}, CsvStyle{'\t', false},
        CsvStyle{'\t', true}, CsvStyle{' ', false}, CsvStyle{' ', true}}) {
    std::size_t read = 0;
    std::size_t with_digits = 0;
    std::size_t fields_of_first = 0;
    std::size_t alike = 0;
    bool units = true;
    bool comma_used = false;
    for (const std::string& line : lines) {
      if (line.find_first_of(kDigits) == std::string::npos) continue;
      ++with_digits;
      std::size_t fields = 0;
      std::size_t numbers = 0;
      bool good = true;
      std::string_view rest = line;
      // Labels and units may contain blanks; blanks separate only bare numbers and "F=0.1N".
      while (!rest.empty()) {
        const std::string_view part = take_csv_part(rest, style.separator);
        const CsvField field = parse_csv_field(part, style.decimal_comma);
        const bool bare = field.label.empty() && field.unit.empty();
        const bool labelled =
            !field.label.empty() && part.find_first_of(":=") != std::string_view::npos;
        // "nan" or nothing, of a sensor that is gone.
        const bool without_value = bare && !field.number;
        if (without_value || (is_label(field) && style.separator != ' ')) {
          ++fields;
          continue;
        }
        ++numbers;
        good = good && field.number &&
               field.unit.find_first_of("0123456789,;") == std::string_view::npos &&
               !holds_a_number(field.label) && (style.separator != ' ' || bare || labelled);
        units = units && !field.unit.empty();
        ++fields;
      }
      comma_used = comma_used || line.find(',') != std::string::npos;
      if (!good || fields > 2 * numbers) continue;
      ++read;
      if (fields_of_first == 0) fields_of_first = fields;
      const bool empty_last =
          fields + 1 == fields_of_first && ends_in_separator(line, style.separator);
      if (fields == fields_of_first || empty_last) ++alike;
    }
    if (with_digits == 0 || 2 * read <= with_digits || 2 * alike <= read) continue;
    if (style.decimal_comma && !comma_used) continue;
    if (style.separator == ' ' && fields_of_first < 2) continue;
    // More columns explain a line better; without a special character, a style is likelier.
    const bool separates = fields_of_first > 1;
    candidates.push_back({style, static_cast<double>(alike) / static_cast<double>(with_digits) +
                                     (separates ? 0.1 : 0.0) + (units ? 0.2 : 0.0) +
                                     (style.decimal_comma ? 0.05 : 0.0)});
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.score > b.score; });
  std::vector<CsvStyle> styles;
  for (const Candidate& candidate : candidates) styles.push_back(candidate.style);
  return styles;
}

std::string csv_advice(const std::vector<std::string>& lines) {
  const bool numbers = std::ranges::any_of(lines, [](const std::string& line) {
    return line.find_first_of(kDigits) != std::string::npos;
  });
  return std::string(numbers && csv_styles(lines).empty() ? kSeparateNumbers : "");
}

std::vector<CsvField> csv_fields_of(std::string_view line, const CsvStyle& style) {
  std::vector<CsvField> fields;
  for (std::string_view rest = line; !rest.empty();) {
    CsvField field = parse_csv_field(take_csv_part(rest, style.separator), style.decimal_comma);
    if (field.label.empty() && !fields.empty() && is_label(fields.back())) {
      field.label = fields.back().label;
    }
    fields.push_back(field);
  }
  return fields;
}

std::string csv_quantity_of(std::string_view label) {
  if (label.empty()) return {};
  const std::string word = lower(label);
  if (is_one_of(word, {"force", "load", "f", "fn", "weight", "w", "kraft"})) return "force";
  if (is_one_of(word, {"fx", "fy", "fz", "force_x", "force_y", "force_z"})) {
    return std::string("force_") + word.back();
  }
  if (is_one_of(word, {"depth", "d", "indentation", "displacement", "disp", "distance", "dist",
                       "travel", "position", "pos"})) {
    return "depth";
  }
  if (is_one_of(word, {"x", "y", "z"})) return word;
  if (is_one_of(word, {"t", "time", "timestamp", "millis", "micros", "ms", "us"})) return "time";
  if (is_one_of(word, {"seq", "n", "count", "sample", "index"})) return "seq";
  return "-";
}

std::string csv_column_of(const CsvField& field) {
  const std::string quantity = csv_quantity_of(field.label);
  const std::string unit(field.unit);
  const std::string label = lower(field.label);
  const std::string low_unit = lower(field.unit);
  const bool time = quantity == "time";
  const bool force = quantity.starts_with("force");
  const bool position = is_one_of(quantity, {"x", "y", "z"});
  if (const auto known = unit_named(unit)) {
    switch (known->quantity) {
      case Quantity::kForce:
        return (force ? quantity : "force") + "_" + unit;
      case Quantity::kLength:
        return (position ? quantity : "depth") + "_" + unit;
      case Quantity::kPressure:
        return field.label.empty() ? "taxel_" + unit : csv_own_name_of(field);
      case Quantity::kVoltage:
      case Quantity::kCount:
      case Quantity::kSync:
        return force || position || quantity == "depth" ? quantity + "_" + unit : "-";
    }
  }
  if (is_one_of(low_unit, {"s", "ms", "us"}) && (time || label.empty())) return "time_" + low_unit;
  if (time && unit.empty() && (label == "millis" || label == "ms")) return "time_ms";
  if (time && unit.empty() && (label == "micros" || label == "us")) return "time_us";
  if (quantity == "seq" && unit.empty()) return quantity;
  if (label == "sync" && unit.empty()) return label;
  return unit.empty() && quantity != "-" ? std::string() : "-";
}

std::string csv_own_name_of(const CsvField& field, const UnitFactors& factors) {
  const auto unit = unit_named(field.unit);
  if (field.label.empty() || !unit || (unit->is_electrical() && !factors.of(field.label, *unit))) {
    return "-";
  }
  return std::string(field.label) + "_" + std::string(field.unit);
}

void tell_csv_columns_apart(std::vector<std::string>& names, const std::vector<CsvField>& fields,
                            const UnitFactors& factors) {
  const std::vector<std::string> given = names;
  std::vector<std::string> taken;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (given[i].empty() || given[i] == "-") continue;
    const bool repeated = std::count(given.begin(), given.end(), given[i]) > 1;
    const std::string own = csv_own_name_of(fields[i], factors);
    const bool labelled = own != "-" && csv_quantity_of(fields[i].label) != "force";
    if (repeated && labelled) names[i] = own;
    const auto is_taken = [&] {
      return std::find(taken.begin(), taken.end(), names[i]) != taken.end();
    };
    const bool in_another_unit = std::ranges::any_of(taken, [&](const std::string& other) {
      return other != names[i] && differ_in_unit(other, names[i]);
    });
    if (in_another_unit) {
      names[i] = "-";
      continue;
    }
    if (is_taken()) {
      const auto mark = names[i].rfind('_');
      if (mark == std::string::npos) {
        names[i] = "-";
        continue;
      }
      names[i].insert(mark, std::to_string(i + 1));
    }
    taken.push_back(names[i]);
  }
}

CsvField parse_csv_heading(std::string_view cell) noexcept {
  cell = trimmed(cell, " \t\"");
  const auto mark = cell.find_last_of("([_");
  if (mark == std::string_view::npos) return {.label = cell, .number = {}, .unit = {}};
  return {.label = trimmed(cell.substr(0, mark)),
          .number = {},
          .unit = trimmed(cell.substr(mark + 1), " \t)]")};
}

std::string_view name_of_separator(char separator) noexcept {
  switch (separator) {
    case ';':
      return "semicolon";
    case '\t':
      return "tab";
    case ' ':
      return "space";
    default:
      return "comma";
  }
}

}  // namespace merkel
