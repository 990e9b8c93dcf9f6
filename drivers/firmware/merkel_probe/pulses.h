// The pulses of a sync line. No heap, no library; the firmware and the simulated device use it.
#pragma once

#include <stdint.h>

namespace hbf1 {

// Irregular pulses for a line that other recorders share: 1 to 20 ms wide, 60 to 500 ms apart. A few
// successive intervals tell each place from all others. The same seed gives the same pulses.
class Pulses {
 public:
  explicit Pulses(uint32_t seed) : state_(seed != 0 ? seed : 1) {}

  bool high() const { return high_; }
  // Goes to the next edge. Returns the time to the one after it.
  uint32_t next_us() {
    high_ = !high_;
    state_ ^= state_ << 13;  // Marsaglia's xorshift
    state_ ^= state_ >> 17;
    state_ ^= state_ << 5;
    return high_ ? 1000U + state_ % 19001U : 60000U + state_ % 440001U;
  }

 private:
  uint32_t state_;
  bool high_ = false;
};

}  // namespace hbf1
