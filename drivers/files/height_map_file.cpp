#include "drivers/files/height_map_file.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include "core/parameters/range.hpp"
#include "drivers/files/csv_text.hpp"
#include "drivers/files/input_file.hpp"
#include "drivers/files/raw_bytes.hpp"
#include "drivers/printable_text.hpp"
#include "drivers/take_part.hpp"

namespace merkel {
namespace {

constexpr std::size_t kMaxPixels = std::size_t{1} << 24U;
constexpr std::size_t kLargestFile = std::size_t{1} << 28U;

struct Heights {
  std::size_t columns = 0;
  std::vector<double> values;  ///< row by row
};

std::string place_of(const Heights& heights, std::size_t i) {
  return "row " + std::to_string(i / heights.columns + 1) + ", column " +
         std::to_string(i % heights.columns + 1);
}

Expected<HeightMap, SetupError> map_of(Heights heights, const std::string& name, double pixel_mm) {
  if (heights.columns < 2 || heights.values.size() < 2 * heights.columns) {
    return bad_input(name + " has fewer than two rows or columns of heights: a shape needs both");
  }
  const auto wrong = std::find_if(heights.values.begin(), heights.values.end(), [](double height) {
    return std::isnan(height) || height == -std::numeric_limits<double>::infinity();
  });
  if (wrong != heights.values.end()) {
    return bad_input(name + " has a height that is not a number at " +
                     place_of(heights, static_cast<std::size_t>(wrong - heights.values.begin())) +
                     ": interpolate it, or write inf where there is no tip");
  }
  const double lowest = *std::min_element(heights.values.begin(), heights.values.end());
  if (std::isinf(lowest)) {
    return bad_input(name + " has no finite height: write the heights of the tip in mm");
  }
  for (double& height : heights.values) height -= lowest;
  return HeightMap{.grid = {.pixel_mm = pixel_mm,
                            .columns = heights.columns,
                            .rows = heights.values.size() / heights.columns},
                   .height_mm = std::move(heights.values),
                   .coverage = {}};
}

/// The text after `'key':` in the header of a NumPy file.
std::optional<std::string_view> entry(std::string_view header, std::string_view key) {
  const std::size_t found = header.find("'" + std::string(key) + "':");
  if (found == std::string_view::npos) return std::nullopt;
  std::string_view rest = header.substr(found + key.size() + 3);
  rest.remove_prefix(std::min(rest.find_first_not_of(' '), rest.size()));
  return rest;
}

std::optional<std::size_t> take_whole(std::string_view& text) {
  text.remove_prefix(std::min(text.find_first_of("0123456789)"), text.size()));
  std::size_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc()) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return value;
}

template <class Real>
double value_at(std::string_view data, std::size_t i) {
  Real value;
  std::memcpy(&value, data.data() + i * sizeof(Real), sizeof(Real));
  return static_cast<double>(value);
}

}  // namespace

Expected<HeightMap, SetupError> parse_npy_heights(std::string_view bytes, const std::string& name,
                                                  double pixel_mm) {
  constexpr std::string_view kMagic("\x93NUMPY", 6);
  const std::string wanted =
      ": write it with numpy.save(name, heights.astype(float)), heights an array of two dimensions";
  if (bytes.size() < 12 || bytes.substr(0, 6) != kMagic) {
    return bad_input(name + " is not a NumPy file" + wanted);
  }
  const auto byte = [&](std::size_t i) {
    return static_cast<std::size_t>(static_cast<unsigned char>(bytes[i]));
  };
  const bool old = byte(6) == 1;
  const std::size_t start = old ? 10 : 12;
  const std::size_t length = old ? byte(8) + 256 * byte(9)
                                 : byte(8) + 256 * byte(9) + 65536 * byte(10) + 16777216 * byte(11);
  if (length > bytes.size() - start) return bad_input(name + " ends within its header" + wanted);
  const std::string_view header = bytes.substr(start, length);
  const std::string_view data = bytes.substr(start + length);
  const auto type = entry(header, "descr");
  const auto order = entry(header, "fortran_order");
  auto shape = entry(header, "shape");
  if (!type || !order || !shape) return bad_input(name + " has an unknown header" + wanted);
  const bool wide = type->substr(0, 5) == "'<f8'";
  if (!wide && type->substr(0, 5) != "'<f4'") {
    return bad_input(name + " does not hold floating-point numbers" + wanted);
  }
  std::string_view sizes = shape->substr(0, shape->find(')'));
  const auto rows = take_whole(sizes);
  const auto columns = take_whole(sizes);
  if (!rows || !columns || take_whole(sizes)) {
    return bad_input(name + " does not hold an array of two dimensions" + wanted);
  }
  if (*rows > kMaxPixels || *columns > kMaxPixels || *rows * *columns > kMaxPixels) {
    return bad_input(name + " has more than 16777216 heights: use larger pixels");
  }
  const std::size_t count = *rows * *columns;
  if (data.size() != count * (wide ? 8 : 4)) {
    return bad_input(name + " does not hold as many numbers as its header says" + wanted);
  }
  const bool by_columns = order->substr(0, 4) == "True";
  Heights heights{.columns = *columns, .values = std::vector<double>(count)};
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t at = by_columns ? i % *columns * *rows + i / *columns : i;
    heights.values[i] = wide ? value_at<double>(data, at) : value_at<float>(data, at);
  }
  return map_of(std::move(heights), name, pixel_mm);
}

Expected<HeightMap, SetupError> parse_csv_heights(std::string_view text, const std::string& name,
                                                  double pixel_mm) {
  Heights heights;
  for (std::size_t line = 1; !text.empty(); ++line) {
    std::string_view rest = take_part(text, '\n');
    if (rest.ends_with('\r')) rest.remove_suffix(1);
    if (rest.find_first_not_of(" \t") == std::string_view::npos) continue;
    std::size_t columns = 0;
    const std::string where = name + ":" + std::to_string(line) + ": ";
    while (!rest.empty()) {
      const std::string_view field = take_field(rest);
      const auto height = parse_number(field);
      if (height && std::isinf(*height) && field.find_first_of("0123456789") != field.npos) {
        return bad_input(where + "column " + std::to_string(columns + 1) + " is " +
                         printable_text(shortened(std::string(field))) +
                         ", which no number can hold: write inf where there is no tip");
      }
      if (!height) {
        return bad_input(where + "column " + std::to_string(columns + 1) +
                         " is not a number: a line holds the heights along x, in mm, with commas");
      }
      heights.values.push_back(*height);
      ++columns;
    }
    if (heights.columns == 0) heights.columns = columns;
    if (columns != heights.columns) {
      return bad_input(where + "this line has " + std::to_string(columns) +
                       " heights, but the first one has " + std::to_string(heights.columns) +
                       ": every line needs the same number");
    }
    if (heights.values.size() > kMaxPixels) {
      return bad_input(name + " has more than 16777216 heights: use larger pixels");
    }
  }
  return map_of(std::move(heights), name, pixel_mm);
}

Expected<HeightMap, SetupError> read_height_map(const std::string& path, double pixel_mm) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    return bad_input("cannot read the shape " + path + ": " +
                     (error ? error.message() : "it is not a file") +
                     "; check the name, which is relative to the scene's folder");
  }
  const auto bytes = read_whole_file(path, "shape", kLargestFile);
  if (!bytes) return Unexpected<SetupError>(bytes.error());
  return path.ends_with(".npy") ? parse_npy_heights(*bytes, path, pixel_mm)
                                : parse_csv_heights(*bytes, path, pixel_mm);
}

std::string csv_heights(const HeightMap& map) {
  std::string text;
  for (std::size_t i = 0; i < map.height_mm.size(); ++i) {
    text += shortest_decimal(map.height_mm[i]);
    text += (i + 1) % map.grid.columns == 0 ? '\n' : ',';
  }
  return text;
}

}  // namespace merkel
