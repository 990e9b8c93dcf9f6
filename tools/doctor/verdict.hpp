#pragma once

#include <string>
#include <string_view>

namespace merkel {

/// What the doctor thinks of one thing.
struct Verdict {
  enum class Grade { kGood, kFair, kPoor, kUnknown };
  Grade grade = Grade::kUnknown;
  std::string what;     ///< "wake-up latency"
  std::string finding;  ///< what is so
  std::string remedy;   ///< what to do about it; empty where nothing is to be done
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
