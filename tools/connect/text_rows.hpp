#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "drivers/protocols/csv_text_style.hpp"
#include "drivers/protocols/text_row.hpp"

namespace merkel {

/// The fields of a device's rows, column by column. Borrows the lines.
struct TextColumns {
  CsvStyle style;
  std::string options;  ///< of the probe URI that reads them so: "&separator=comma&…"
  std::vector<std::string> keys = {};  ///< what the rows call each column; empty: nothing
  std::vector<std::vector<CsvField>> fields = {};
  std::vector<TextRow> rows = {};  ///< to which the fields of JSON refer
};

/// Joins the lines of frames, between which other lines stand: at an equal number of lines of
/// several numbers, of which no column counts on.
/// \param lines  empty ones included; gets the rows, without empty lines
/// \return the number of lines of a frame; 0: each line is a row
[[nodiscard]] std::size_t join_frames(std::vector<std::string>& lines);

/// The ways to split lines into columns, likeliest first: JSON, or the styles of lines.
[[nodiscard]] std::vector<TextColumns> columns_of_lines(const std::vector<std::string>& lines);

}  // namespace merkel
