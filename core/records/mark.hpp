#pragma once

#include <chrono>
#include <string>

namespace merkel {

/// An instant marked by the user, such as the start of a trial.
struct Mark {
  std::chrono::nanoseconds time{0};  ///< probe time
  std::string label;                 ///< UTF-8, one line
};

}  // namespace merkel
