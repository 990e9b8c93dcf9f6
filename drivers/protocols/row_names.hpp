#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/protocols/csv_columns.hpp"
#include "drivers/protocols/csv_text_style.hpp"
#include "drivers/protocols/protocol.hpp"
#include "drivers/protocols/text_row.hpp"

namespace merkel {

/// What the values in the rows of a device mean: by the option `columns`, by a header, or by names
/// in the rows themselves. Names that come later are obeyed: a column is the one of the same name,
/// wherever it stands and in whichever unit, and has the same channel. Bounded.
class RowNames {
 public:
  static constexpr std::size_t kIgnored = static_cast<std::size_t>(-1);

  /// \param given  by the option `columns`; empty: none
  RowNames(std::vector<CsvColumn> given, UnitFactors factors);

  /// Of each value of a row, the number of its column; kIgnored: none.
  [[nodiscard]] const std::vector<std::size_t>& layout() const noexcept { return layout_; }
  [[nodiscard]] const CsvColumn& column(std::size_t number) const noexcept {
    return columns_[number];
  }
  /// All columns so far.
  [[nodiscard]] const std::vector<CsvColumn>& columns() const noexcept { return columns_; }
  [[nodiscard]] bool known() const noexcept { return !columns_.empty(); }
  /// True if the rows name their values.
  [[nodiscard]] bool in_rows() const noexcept { return in_rows_; }
  /// The channels: of the present columns, or all that rows have named.
  [[nodiscard]] std::vector<ChannelName> channels() const;
  /// The names of the present columns, for messages.
  [[nodiscard]] std::string list() const;

  /// A column in volts or counts that lacks its factor, for the user; empty: none.
  [[nodiscard]] const std::string& error_message() const noexcept { return error_message_; }

  /// What became of a line that may be a header.
  struct Header {
    bool is_one = false;
    bool changed = false;  ///< layout() and column() have changed
    std::string notice;    ///< for the user, if they were known before; empty: none
  };
  /// \param cut  the line may lack its beginning
  Header take_header(const std::vector<std::string>& cells, bool cut);
  /// Takes the names in a row. \param units  beside their numbers; empty: of JSON, whose names are
  /// not those of given columns by their places. \return whether layout() has changed; nothing if
  /// none is measured: such a row changes nothing
  std::optional<bool> take_row(const std::vector<std::string>& names,
                               const std::vector<std::string>& units);
  /// Takes the columns of rows without names. False if none measures.
  bool take_columns(const std::vector<std::string>& names);

 private:
  static constexpr std::size_t kMaxColumns = 2048;

  bool take(const std::vector<std::string>& cells, const std::vector<std::string>& names);
  bool name_given(const std::vector<std::string>& cells, const std::vector<std::string>& names);
  [[nodiscard]] std::size_t known_column(const std::string& cell, const CsvColumn* meaning,
                                         const std::vector<bool>& taken) const;
  /// The layout of cells that mean columns. \return how many are known
  std::size_t lay_out(const std::vector<std::string>& cells, const std::vector<std::string>& names,
                      std::vector<std::size_t>& layout, std::vector<CsvColumn>& columns);

  bool given_;
  UnitFactors factors_;
  std::string error_message_;
  bool in_rows_ = false;
  bool named_ = false;              ///< the device has named its values
  std::vector<CsvColumn> columns_;  ///< all so far
  std::vector<std::size_t> layout_;
  std::vector<std::string> cells_;  ///< the header or the names in the last row
  std::vector<std::string> other_;  ///< the names in the last row in which nothing was measured
};

/// Reads a line whose numbers have labels: "t=0.001 thumb=0.2 N". False if a number has none.
/// \param units  beside the numbers
[[nodiscard]] bool read_labelled_row(std::string_view line, const CsvStyle& style, TextRow& row,
                                     std::vector<std::string>& units);

/// What to do about a line whose values have no names or no units.
/// \param row  its names and values, if it is read as such; else empty
[[nodiscard]] std::string csv_unnamed(std::string_view line, const TextRow& row);

}  // namespace merkel
