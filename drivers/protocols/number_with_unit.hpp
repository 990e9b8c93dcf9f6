#pragma once

#include <optional>
#include <string_view>

namespace merkel {

/// A reading in the form of an instrument's display: "-18.78 lbF", "4.285N", "12.5".
struct NumberWithUnit {
  double value = 0.0;
  std::string_view unit;  ///< empty: none
};

/// Removes such a reading from the start of `rest`, with the blanks and commas around it. Empty if
/// `rest` does not start with a number.
[[nodiscard]] std::optional<NumberWithUnit> take_number_with_unit(std::string_view& rest) noexcept;

}  // namespace merkel
