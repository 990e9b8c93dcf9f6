#pragma once

#include "core/expected.hpp"
#include "tools/connect/recognition.hpp"

namespace merkel {

/// Picks one of the interpretations of what a device sends, or the columns that the user types in
/// the terminal. Fails without a terminal. \param likeliest  takes the first without a question
[[nodiscard]] Expected<Reading, SetupError> choose_reading(const Recognition& found,
                                                           bool likeliest);

}  // namespace merkel
