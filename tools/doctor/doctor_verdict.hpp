#pragma once

#include <string>
#include <string_view>

namespace merkel {

/// The doctor's result for one check.
struct Verdict {
  enum class Grade { kGood, kFair, kPoor, kUnknown };
  Grade grade = Grade::kUnknown;
  std::string what;     ///< "wake-up latency"
  std::string finding;  ///< the observed state
  std::string remedy;   ///< what to do; empty if nothing
};

/// "good", "fair", "poor", "unknown".
[[nodiscard]] constexpr std::string_view name_of(Verdict::Grade grade) noexcept {
  switch (grade) {
    case Verdict::Grade::kGood:
      return "good";
    case Verdict::Grade::kFair:
      return "fair";
    case Verdict::Grade::kPoor:
      return "poor";
    case Verdict::Grade::kUnknown:
      return "unknown";
  }
  return "";
}

}  // namespace merkel
