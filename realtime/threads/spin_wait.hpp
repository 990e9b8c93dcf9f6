#pragma once

#include <sched.h>

#if defined(__x86_64__) || defined(__i386__)
#include <immintrin.h>
#endif

#include "core/realtime_tag.hpp"

namespace merkel {

/// Marks a spin loop for the core, which saves power and frees resources for its sibling thread.
/// Real-time: yes.
inline void pause_core() noexcept MERKEL_REALTIME {
#if defined(__x86_64__) || defined(__i386__)
  _mm_pause();
#elif defined(__aarch64__)
  asm volatile("yield");
#endif
}

/// Waits for another thread within microseconds. Spins at first; if the wait is so long that the
/// other thread must have lost its core, yields this core. Never sleeps. Real-time: yes.
class SpinWait {
 public:
  void once() noexcept MERKEL_REALTIME {
    if (++spins_ < kSpins) {
      pause_core();
    } else {
      ::sched_yield();
    }
  }

 private:
  static constexpr int kSpins = 4000;  ///< tens of microseconds
  int spins_ = 0;
};

}  // namespace merkel
