#pragma once

#include <string_view>

namespace merkel {

/// A row of a table of counters.
template <class Struct, class Cell>
struct CounterField {
  std::string_view name;
  std::string_view unit;  ///< empty: a plain count
  std::string_view meaning;
  Cell Struct::*cell;
  bool fault = false;    ///< a value above 0 means that something was late or lost
  bool largest = false;  ///< several sources have their largest value in common, not their sum
};

}  // namespace merkel
