#include "core/parameters/nearest_name.hpp"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

namespace merkel {
namespace {

/// Levenshtein distance: insertions, deletions and substitutions.
std::size_t edits(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substituted});
    }
  }
  return row.back();
}

}  // namespace

std::string nearest_name(std::string_view name, std::span<const std::string> candidates) {
  std::string best;
  std::size_t fewest = std::max<std::size_t>(2, name.size() / 3) + 1;
  for (const std::string& candidate : candidates) {
    // Of a short name, two edits leave little.
    if (name.size() <= 3 && !candidate.starts_with(name.substr(0, 1))) continue;
    // A prefix, such as "delay" of "delay_ms", is near however much is missing.
    const bool begins = name.size() >= 3 && candidate.starts_with(name);
    // At least as many edits as one is longer than the other: a name of a megabyte takes no time.
    const auto [shorter, longer] = std::minmax({name.size(), candidate.size()});
    if (!begins && longer - shorter >= fewest) continue;
    const std::size_t distance = begins ? 1 : edits(name, candidate);
    if (distance < fewest) {
      fewest = distance;
      best = candidate;
    }
  }
  return best;
}

std::string did_you_mean(std::string_view name, std::span<const std::string> known,
                         const std::string& otherwise) {
  const std::string nearest = nearest_name(name, known);
  return nearest.empty() ? otherwise : ": did you mean " + nearest + "?";
}

}  // namespace merkel
