#pragma once

#include <sched.h>

#if defined(__x86_64__) || defined(__i386__)
#include <immintrin.h>
#endif

#include "core/realtime_tag.hpp"

namespace merkel {

/// Tells the core that this is a spin, so that it saves power and a sibling thread gets on.
/// Real-time: yes.
inline void pause_core() noexcept MERKEL_REALTIME {
#if defined(__x86_64__) || defined(__i386__)
  _mm_pause();
#elif defined(__aarch64__)
  asm volatile("yield");
#endif
}

/// Waiting for another thread within microseconds: spins, and where that takes so long that the
/// other thread must have lost its core, offers it this one. Never sleeps. Real-time: yes.
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
  static constexpr int kSpins = 4000;  ///< some tens of microseconds
  int spins_ = 0;
};

}  // namespace merkel
