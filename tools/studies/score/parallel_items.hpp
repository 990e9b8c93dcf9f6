#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <thread>
#include <vector>

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

}  // namespace merkel
