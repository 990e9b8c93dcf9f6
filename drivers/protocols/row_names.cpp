#include "drivers/protocols/row_names.hpp"

#include <algorithm>
#include <cctype>

namespace merkel {
namespace {

bool equal_ignoring_case(std::string_view a, std::string_view b) noexcept {
  return std::ranges::equal(a, b, [](char x, char y) {
    return std::tolower(static_cast<unsigned char>(x)) ==
           std::tolower(static_cast<unsigned char>(y));
  });
}

/// A unit that a later name states replaces the one so far.
void take_unit(CsvColumn& column, const CsvColumn& meaning) {
  column.name = meaning.name;
  column.set_factor(meaning.factor);
  column.nanoseconds = meaning.nanoseconds;
}

std::string names_in(const std::vector<CsvColumn>& columns,
                     const std::vector<std::size_t>& layout) {
  std::vector<std::string> names;
  for (const std::size_t place : layout) {
    const bool ignored = place == RowNames::kIgnored || columns[place].name.empty();
    names.push_back(ignored ? "-" : columns[place].name);
  }
  return csv_list_of(names);
}

}  // namespace

RowNames::RowNames(std::vector<CsvColumn> given, UnitFactors factors)
    : given_(!given.empty()), factors_(std::move(factors)), columns_(std::move(given)) {
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    layout_.push_back(columns_[i].kind == CsvColumn::Kind::kSkip ? kIgnored : i);
  }
}

std::string RowNames::list() const { return names_in(columns_, layout_); }

std::vector<ChannelName> RowNames::channels() const {
  if (in_rows_) return names_of_columns(columns_);
  std::vector<CsvColumn> present;
  for (const std::size_t place : layout_) {
    present.push_back(place == kIgnored ? CsvColumn{} : columns_[place]);
  }
  return names_of_columns(present);
}

/// The column that a cell names: by what the device calls it, by its quantity, or without a unit.
std::size_t RowNames::known_column(const std::string& cell, const CsvColumn* meaning,
                                   const std::vector<bool>& taken) const {
  const auto first = [&](const auto& is_it) {
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      if (!taken[i] && columns_[i].kind != CsvColumn::Kind::kSkip && is_it(columns_[i])) return i;
    }
    return kIgnored;
  };
  const std::size_t by_key =
      first([&](const CsvColumn& column) { return !cell.empty() && column.key == cell; });
  if (by_key != kIgnored) return by_key;
  if (meaning != nullptr) {
    return first([&](const CsvColumn& column) {
      return column.key.empty() && same_quantity(column, *meaning);
    });
  }
  const std::string quantity = csv_quantity_of(cell);
  return first([&](const CsvColumn& column) {
    const std::string_view stem = std::string_view(column.name).substr(0, column.name.rfind('_'));
    return column.key.empty() && (equal_ignoring_case(stem, cell) || stem == quantity);
  });
}

std::size_t RowNames::lay_out(const std::vector<std::string>& cells,
                              const std::vector<std::string>& names,
                              std::vector<std::size_t>& layout, std::vector<CsvColumn>& columns) {
  std::size_t known = 0;
  std::vector<bool> taken(columns_.size());
  auto own_names = static_cast<std::size_t>(std::ranges::count_if(
      columns_, [](const CsvColumn& column) { return is_named(column.channel); }));
  for (std::size_t i = 0; i < cells.size(); ++i) {
    auto parsed = csv_column_named(names[i], factors_);
    const bool means = parsed && parsed->kind != CsvColumn::Kind::kSkip;
    const std::size_t place = known_column(cells[i], means ? &*parsed : nullptr, taken);
    if (place != kIgnored) {
      taken[place] = true;
      ++known;
      if (means && columns[place].key.empty()) take_unit(columns[place], *parsed);
      layout.push_back(place);
      continue;
    }
    if (!parsed && !given_ && is_electrical_press(names[i])) error_message_ = parsed.error();
    // Whoever names the columns may leave out the time.
    const bool wanted = means && (!given_ || parsed->kind == CsvColumn::Kind::kValue);
    if (!wanted || columns.size() == kMaxColumns) {
      layout.push_back(kIgnored);
      continue;
    }
    if (parsed->kind == CsvColumn::Kind::kValue && is_named(parsed->channel)) {
      parsed->channel = named_channel(own_names++);
    }
    layout.push_back(columns.size());
    columns.push_back(std::move(*parsed));
  }
  return known;
}

/// The first time that the device names the given columns: those that it calls something else are
/// known by their places. False if there are none.
bool RowNames::name_given(const std::vector<std::string>& cells,
                          const std::vector<std::string>& names) {
  if (std::exchange(named_, true) || !given_) return false;
  std::vector<std::size_t> places = layout_;
  if (places.size() != cells.size()) std::erase(places, kIgnored);
  if (places.size() != cells.size()) return false;
  std::vector<std::size_t> layout;
  std::vector<CsvColumn> columns = columns_;
  const std::size_t known = lay_out(cells, names, layout, columns);
  bool any = false;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const bool unknown = layout[i] == kIgnored || (known == 0 && layout[i] >= columns_.size());
    if (places[i] == kIgnored || !unknown || std::ranges::count(layout, places[i]) > 0) continue;
    columns_[places[i]].key = cells[i];
    any = true;
  }
  return any;
}

RowNames::Header RowNames::take_header(const std::vector<std::string>& cells, bool cut) {
  if (!cells_.empty() && cells == cells_) return {.is_one = true};
  // The end of the same header.
  const bool end = cut && !cells.empty() && cells.size() <= cells_.size() &&
                   cells_[cells_.size() - cells.size()].ends_with(cells.front()) &&
                   std::equal(cells.begin() + 1, cells.end(),
                              cells_.end() - static_cast<std::ptrdiff_t>(cells.size()) + 1);
  if (end) return {.is_one = true};
  std::vector<std::string> names = csv_columns_of_header(cells, factors_);
  const bool certain = !names.empty();
  if (!certain && !known()) return {};
  names.resize(cells.size(), "-");
  if (!certain) {
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (csv_column_named(cells[i], factors_)) names[i] = cells[i];
    }
  }
  std::vector<std::size_t> layout;
  std::vector<CsvColumn> columns = columns_;
  const std::size_t found = lay_out(cells, names, layout, columns);
  const bool like = found > 0 && (found > 1 || cells.size() == layout_.size());
  if (!certain && (!like || 2 * found < cells.size())) return {};
  const bool first = !named_;
  if (name_given(cells, names)) {
    columns = columns_;
    layout.clear();
    static_cast<void>(lay_out(cells, names, layout, columns));
  }
  cells_ = cells;
  const std::string before = list();
  const bool known_before = !layout_.empty();
  columns_ = std::move(columns);
  layout_ = std::move(layout);
  Header header{.is_one = true, .changed = true};
  if (const std::string now = list(); known_before && now != before) {
    header.notice = (given_ && first ? "its header names " + now + ", not " + before
                                     : "its header has changed from " + before + " to " + now) +
                    ": its columns are read by their names";
  }
  return header;
}

std::optional<bool> RowNames::take_row(const std::vector<std::string>& names,
                                       const std::vector<std::string>& units) {
  if (in_rows_ && names == cells_) return false;
  if (names == other_) return std::nullopt;
  const std::vector<std::string> meanings = csv_columns_of_labels(names, units, factors_);
  if (!units.empty()) static_cast<void>(name_given(names, meanings));
  if (!take(names, meanings)) {
    other_ = names;
    return std::nullopt;
  }
  in_rows_ = true;
  cells_ = names;
  return true;
}

bool RowNames::take_columns(const std::vector<std::string>& names) {
  return take(std::vector<std::string>(names.size()), names);
}

/// Takes the layout of cells that mean columns. False, and nothing changes, if none measures.
bool RowNames::take(const std::vector<std::string>& cells, const std::vector<std::string>& names) {
  std::vector<std::size_t> layout;
  std::vector<CsvColumn> columns = columns_;
  static_cast<void>(lay_out(cells, names, layout, columns));
  const bool measures = std::ranges::any_of(layout, [&](std::size_t place) {
    return place != kIgnored && columns[place].kind == CsvColumn::Kind::kValue &&
           columns[place].quantity != Quantity::kSync;
  });
  if (!measures) return false;
  layout_ = std::move(layout);
  columns_ = std::move(columns);
  return true;
}

bool read_labelled_row(std::string_view line, const CsvStyle& style, TextRow& row,
                       std::vector<std::string>& units) {
  row.names.clear();
  row.values.clear();
  units.clear();
  std::string_view label;  // in a field of its own
  while (!line.empty()) {
    const std::string_view part = take_csv_part(line, style.separator);
    const CsvField field = parse_csv_field(part, style.decimal_comma);
    if (!field.number) {
      label = field.label;
      continue;
    }
    const std::string_view name = field.label.empty() ? label : field.label;
    if (name.empty() || row.names.size() == TextRow::kMaxValues) return false;
    row.names.emplace_back(name);
    row.values.emplace_back(part);
    units.emplace_back(field.unit);
    label = {};
  }
  return !row.names.empty();
}

std::string csv_unnamed(std::string_view line, const TextRow& row) {
  const std::string its_lines = "its lines, such as \"" + std::string(line) + "\", ";
  const std::string remedy =
      ": run merkel connect, which recognises them, or name the columns and "
      "units, for example columns=";
  std::string names;
  if (!row.names.empty()) {
    const bool time = csv_quantity_of(row.names.front()) == "time" && row.names.size() > 1;
    names = (time ? row.names.front() + ":time_s," : "") + row.names[time ? 1 : 0] + ":force_N";
    return its_lines + "state no units" + remedy + names;
  }
  const std::vector<CsvStyle> styles = csv_styles({std::string(line)});
  if (styles.empty()) {
    return its_lines + "do not tell numbers from text: " + std::string(kSeparateNumbers);
  }
  const CsvStyle style = styles.front();
  std::vector<std::string> values = row.values;
  if (values.empty()) values = csv_cells_of(line, style.separator);
  // The first number with decimals is the likeliest force; whole numbers count or tell time.
  const auto decimals = std::ranges::find_if(values, [&](const std::string& value) {
    return value.find(style.decimal_comma ? ',' : '.') != std::string::npos;
  });
  const auto force = decimals == values.end() ? values.begin() : decimals;
  for (auto value = values.begin(); value != values.end(); ++value) {
    names += (names.empty() ? "" : ",") + std::string(value == force ? "force_N" : "-");
  }
  return its_lines + "have no labels" + remedy + names +
         " (time_us, seq, depth_mm; - ignores a column)";
}

}  // namespace merkel
