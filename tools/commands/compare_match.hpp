#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "core/units.hpp"

namespace merkel {

/// The items of two files, matched.
template <class Item>
struct Matching {
  std::vector<std::pair<Item, Item>> pairs;
  std::vector<Item> only_a;  ///< without a partner in B
  std::vector<Item> only_b;

  [[nodiscard]] bool complete() const noexcept { return only_a.empty() && only_b.empty(); }
};

/// Matches items of the same key (a neuron, an electrode) in order of time. Partners are at most
/// `within` apart.
/// \param a, b  in order of time
template <class Item, class KeyOf>
[[nodiscard]] Matching<Item> match(const std::vector<Item>& a, const std::vector<Item>& b,
                                   std::chrono::nanoseconds within, const KeyOf& key_of) {
  std::map<decltype(key_of(a.front())), std::pair<std::vector<Item>, std::vector<Item>>> trains;
  for (const Item& item : a) trains[key_of(item)].first.push_back(item);
  for (const Item& item : b) trains[key_of(item)].second.push_back(item);
  Matching<Item> result;
  for (const auto& [key, train] : trains) {
    const auto& [in_a, in_b] = train;
    std::size_t i = 0;
    std::size_t j = 0;
    while (i < in_a.size() || j < in_b.size()) {
      if (j == in_b.size() || (i < in_a.size() && in_a[i].time < in_b[j].time - within)) {
        result.only_a.push_back(in_a[i++]);
      } else if (i == in_a.size() || in_b[j].time < in_a[i].time - within) {
        result.only_b.push_back(in_b[j++]);
      } else {
        result.pairs.emplace_back(in_a[i++], in_b[j++]);
      }
    }
  }
  const auto earlier = [](const Item& x, const Item& y) { return x.time < y.time; };
  std::stable_sort(result.only_a.begin(), result.only_a.end(), earlier);
  std::stable_sort(result.only_b.begin(), result.only_b.end(), earlier);
  return result;
}

/// Differences in time between partners.
struct TimeDifference {
  double rms_us = 0.0;
  double largest_us = 0.0;
};

template <class Item>
[[nodiscard]] TimeDifference time_difference(const Matching<Item>& matching) {
  TimeDifference result;
  double sum = 0.0;
  for (const auto& [a, b] : matching.pairs) {
    const double apart_us = units::us_from(a.time - b.time);
    sum += apart_us * apart_us;
    result.largest_us = std::max(result.largest_us, std::fabs(apart_us));
  }
  if (sum > 0.0) result.rms_us = std::sqrt(sum / static_cast<double>(matching.pairs.size()));
  return result;
}

}  // namespace merkel
