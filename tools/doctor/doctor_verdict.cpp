#include "tools/doctor/doctor_verdict.hpp"

#include <algorithm>
#include <array>
#include <sstream>

#include "tools/filled_text.hpp"

namespace merkel {
namespace {

constexpr std::array<std::string_view, 4> kGrades = {"good", "fair", "poor", "unknown"};

}  // namespace

std::string_view name_of(Verdict::Grade grade) noexcept {
  return kGrades[static_cast<std::size_t>(grade)];
}

std::vector<Verdict> verdicts_of(std::string_view text, const Json& facts) {
  std::vector<Verdict> verdicts;
  std::istringstream lines(filled_text(text, facts));
  for (std::string grade; std::getline(lines, grade, '|');) {
    Verdict& verdict = verdicts.emplace_back();
    verdict.grade =
        static_cast<Verdict::Grade>(std::ranges::find(kGrades, grade) - kGrades.begin());
    std::getline(lines, verdict.what, '|');
    std::getline(lines, verdict.finding, '|');
    std::getline(lines, verdict.remedy);
  }
  return verdicts;
}

}  // namespace merkel
