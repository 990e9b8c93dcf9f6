#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

namespace merkel {

/// `title: COUNT` and a line for each of the first items; nothing if there are none.
template <class Item, class Describe>
[[nodiscard]] std::string list_of(const std::string& title, const std::vector<Item>& items,
                                  const Describe& describe) {
  constexpr std::size_t kShown = 10;
  if (items.empty()) return {};
  std::string text = title + ": " + std::to_string(items.size()) + "\n";
  for (std::size_t i = 0; i < std::min(kShown, items.size()); ++i) {
    text += "  " + describe(items[i]) + "\n";
  }
  if (items.size() > kShown) {
    text += "  and " + std::to_string(items.size() - kShown) + " more\n";
  }
  return text;
}

}  // namespace merkel
