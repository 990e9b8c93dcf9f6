#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "drivers/probes/open_probe.hpp"

namespace merkel {

/// Retries while waiting for an event; large, for busy machines.
inline constexpr int kPatience = 1000;

/// Sends every 5 ms until it is told to stop. \param send  borrowed
inline std::jthread sending(const std::function<void()>& send) {
  return std::jthread([&send](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      send();
      std::this_thread::sleep_for(std::chrono::milliseconds{5});
    }
  });
}

/// Opens a probe and calls `send` meanwhile, because the device is silent by itself.
inline std::unique_ptr<Probe> open_while(const std::string& uri,
                                         const std::function<void()>& send) {
  std::jthread sender = sending(send);
  auto probe = open_probe(uri);
  sender.request_stop();
  sender.join();
  EXPECT_TRUE(probe.has_value()) << probe.error().sentence;
  return probe ? std::move(*probe) : nullptr;
}

/// The error for a URI that cannot be opened.
inline std::string refusal(const std::string& uri) {
  const auto probe = open_probe(uri);
  EXPECT_FALSE(probe.has_value());
  return probe ? "" : probe.error().sentence;
}

/// Reads until no more samples arrive.
inline void forget_old(Probe& probe) {
  std::vector<ProbeSample> samples(64);
  for (int reads = 0; reads < kPatience; ++reads) {
    const auto got = probe.read(samples, std::chrono::milliseconds{50});
    EXPECT_TRUE(got.has_value());
    if (!got || *got == 0) return;
  }
}

/// Reads until `count` samples have arrived.
inline std::vector<ProbeSample> listen(Probe& probe, std::size_t count) {
  std::vector<ProbeSample> heard;
  std::vector<ProbeSample> samples(64);
  for (int reads = 0; reads < kPatience && heard.size() < count; ++reads) {
    const auto got = probe.read(samples, std::chrono::milliseconds{10});
    EXPECT_TRUE(got.has_value());
    if (!got) break;
    heard.insert(heard.end(), samples.begin(), samples.begin() + static_cast<std::ptrdiff_t>(*got));
  }
  EXPECT_GE(heard.size(), count);
  return heard;
}

/// Reads until a sample of this force arrives; earlier samples may precede it.
inline bool gives(Probe& probe, double force_mN) {
  std::vector<ProbeSample> samples(64);
  for (int reads = 0; reads < kPatience; ++reads) {
    const auto got = probe.read(samples, std::chrono::milliseconds{10});
    if (!got) return false;
    const auto end = samples.begin() + static_cast<std::ptrdiff_t>(*got);
    if (std::any_of(samples.begin(), end, [&](const ProbeSample& sample) {
          return std::fabs(sample.force_mN - force_mN) < 1e-9;
        })) {
      return true;
    }
  }
  return false;
}

/// Reads until the probe has a notice with these words.
inline bool is_told(Probe& probe, std::string_view words) {
  std::vector<ProbeSample> samples(64);
  for (int reads = 0; reads < kPatience; ++reads) {
    for (const std::string& notice : probe.take_notices()) {
      if (notice.find(words) != std::string::npos) return true;
    }
    EXPECT_TRUE(probe.read(samples, std::chrono::milliseconds{10}).has_value());
  }
  return false;
}

}  // namespace merkel
