#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <optional>
#include <thread>
#include <vector>

#include "core/parameters/parameter_error.hpp"

namespace merkel {

/// Calls work(worker, item) once for each item, on up to `threads` threads; no two calls with the
/// same worker, from 0, run at once. Items must not depend on each other or on their worker.
template <class Work>
void for_each_item(std::size_t items, std::size_t threads, const Work& work) {
  std::atomic<std::size_t> next{0};
  const auto run = [&](std::size_t worker) {
    for (std::size_t item = next++; item < items; item = next++) work(worker, item);
  };
  std::vector<std::jthread> others;
  for (std::size_t worker = 1; worker < std::min(threads, items); ++worker) {
    others.emplace_back(run, worker);
  }
  run(0);
}

/// The same for work that can fail. \return the first error, in the order of the items
template <class Work>
[[nodiscard]] std::optional<ParameterError> try_each_item(std::size_t items, std::size_t threads,
                                                          const Work& work) {
  std::vector<std::optional<ParameterError>> errors(items);
  for_each_item(items, threads,
                [&](std::size_t worker, std::size_t item) { errors[item] = work(worker, item); });
  for (auto& error : errors) {
    if (error) return error;
  }
  return std::nullopt;
}

}  // namespace merkel
