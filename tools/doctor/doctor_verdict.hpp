#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tools/json_text.hpp"

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
[[nodiscard]] std::string_view name_of(Verdict::Grade grade) noexcept;

/// The lines of a text of tools/texts, filled with facts: grade|what|finding|remedy.
[[nodiscard]] std::vector<Verdict> verdicts_of(std::string_view text, const Json& facts);

}  // namespace merkel
