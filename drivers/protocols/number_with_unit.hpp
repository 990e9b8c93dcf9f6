#pragma once

#include <optional>
#include <string_view>

namespace merkel {

/// One reading as instruments display it: "-18.78 lbF", "4.285N", "12.5".
struct NumberWithUnit {
  double value = 0.0;
  std::string_view unit;  ///< empty, where there is none
};

/// Takes it off the beginning of `rest`, with the blanks and commas before and after it. Nothing
/// where that is not a number.
[[nodiscard]] std::optional<NumberWithUnit> take_number_with_unit(std::string_view& rest) noexcept;

}  // namespace merkel
