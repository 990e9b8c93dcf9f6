#pragma once

#include <atomic>
#include <cstdint>

#include "core/realtime_tag.hpp"

namespace merkel {

/// A counter that one thread increments and any thread reads, without locks.
class Counter {
 public:
  void add(std::uint64_t amount = 1) noexcept MERKEL_REALTIME {
    value_.store(value() + amount, std::memory_order_relaxed);
  }
  void raise_to(std::uint64_t at_least) noexcept MERKEL_REALTIME {
    if (at_least > value()) value_.store(at_least, std::memory_order_relaxed);
  }
  [[nodiscard]] std::uint64_t value() const noexcept {
    return value_.load(std::memory_order_relaxed);
  }

 private:
  std::atomic<std::uint64_t> value_{0};
};

}  // namespace merkel
