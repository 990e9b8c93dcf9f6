#include "tools/connect/reading_choice.hpp"

#include <algorithm>
#include <cstdio>
#include <optional>
#include <string>

#include <unistd.h>

#include "drivers/files/csv_text.hpp"
#include "drivers/protocols/csv_columns.hpp"

namespace merkel {
namespace {

/// A line from the terminal without its end; empty at the end of input.
std::optional<std::string> typed_line() {
  std::string line;
  int c = std::getchar();
  if (c == EOF) return std::nullopt;
  for (; c != '\n' && c != EOF; c = std::getchar()) line += static_cast<char>(c);
  return line;
}

/// Lets the user choose an interpretation, or type the columns. Empty at the end of input.
std::optional<Reading> asked(const Recognition& found) {
  const Reading& likeliest = found.readings.front();
  const auto of_likeliest = csv_columns_named(likeliest.columns, ',');
  const std::size_t columns = of_likeliest ? of_likeliest->size() : 0;
  std::printf("columns are %s\n", csv_column_names().c_str());
  while (true) {
    std::printf("which one (1 to %zu), or type the columns, for example %s: ",
                found.readings.size(), likeliest.columns.c_str());
    std::fflush(stdout);
    const auto answer = typed_line();
    if (!answer) return std::nullopt;
    if (const auto number = parse_number(*answer)) {
      const double last = static_cast<double>(found.readings.size());
      if (*number >= 1.0 && *number <= last) {
        return found.readings[static_cast<std::size_t>(*number) - 1];
      }
      continue;
    }
    const auto named = csv_columns_named(*answer, ',');
    if (!named) {
      std::printf("%s\n", named.error().c_str());
    } else if (named->size() != columns) {
      std::printf("the lines have %zu columns, but you named %zu\n", columns, named->size());
    } else {
      Reading reading = likeliest;
      reading.columns = *answer;
      std::erase(reading.columns, ' ');
      reading.meaning = reading.columns;
      return reading;
    }
  }
}

/// A unit that is not stated is not guessed: a wrong one scales every press.
Unexpected<SetupError> without_unit(const Recognition& found) {
  const Reading& first = found.readings.front();
  std::vector<std::string> names = csv_names_of(first.columns);
  std::string key;
  for (std::string& name : names) {
    if (std::find(first.assumed.begin(), first.assumed.end(), name) == first.assumed.end())
      continue;
    const auto column = csv_column_named(name);
    if (!column) continue;
    name.replace(name.rfind('_') + 1, std::string::npos, "count");
    if (key.empty()) {
      key = column->quantity == Quantity::kPressure ? "pressure_kPa"
            : column->quantity == Quantity::kForce  ? "force_N"
                                                    : "depth_mm";
    }
  }
  Reading counts = first;
  counts.columns = csv_list_of(names);
  return bad_input("the numbers have no unit, and --yes does not choose one: to read them as " +
                   first.assumed.front() + ", use the URI '" + found.uri(first) +
                   "'; counts and volts are named so, and have a factor: '" + found.uri(counts) +
                   "&" + key + "_per_count=1'");
}

}  // namespace

Expected<Reading, SetupError> choose_reading(const Recognition& found, bool likeliest) {
  const Reading& first = found.readings.front();
  if (found.readings.size() < 2 && first.assumed.empty()) return first;
  std::printf("the lines do not state all units; they can be read in several ways:\n");
  for (std::size_t i = 0; i < found.readings.size(); ++i) {
    std::printf("  %zu: %s\n", i + 1, found.readings[i].meaning.c_str());
  }
  if (likeliest && first.assumed.empty()) {
    std::printf("using the first, which is the likeliest; URI of the second: %s\n",
                found.uri(found.readings[1]).c_str());
    return first;
  }
  if (likeliest) return without_unit(found);
  const Reading& other = found.readings[std::min<std::size_t>(1, found.readings.size() - 1)];
  const auto reading = ::isatty(STDIN_FILENO) != 0 ? asked(found) : std::nullopt;
  if (reading) return *reading;
  return bad_input(
      "several interpretations are possible: run the command in a terminal, or use the URI " +
      found.uri(other) + " (" + other.meaning +
      "), or one with the columns that you know; columns are " + csv_column_names());
}

}  // namespace merkel
