#pragma once

#include <chrono>
#include <cstddef>
#include <vector>

#include <gtest/gtest.h>

#include "drivers/probe.hpp"

namespace merkel {

/// Reads `count` samples: fewer if the probe fails, which fails the test, or if none arrives in
/// `patience` reads of 10 ms one after the other.
inline std::vector<ProbeSample> read_samples(Probe& probe, std::size_t count, int patience = 1000) {
  std::vector<ProbeSample> all;
  std::vector<ProbeSample> samples(256);
  for (int empty = 0; empty < patience && all.size() < count;) {
    const auto got = probe.read(samples, std::chrono::milliseconds{10});
    if (!got) {
      ADD_FAILURE() << "the probe failed after " << all.size() << " samples";
      break;
    }
    empty = *got == 0 ? empty + 1 : 0;
    all.insert(all.end(), samples.begin(), samples.begin() + static_cast<std::ptrdiff_t>(*got));
  }
  return all;
}

}  // namespace merkel
