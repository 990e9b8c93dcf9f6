#pragma once

#include <cstddef>

namespace merkel {

/// What a kernel of noisy neurons tells of a spike. Real-time: yes.
class SpikeObserver {
 public:
  /// \param neuron  from 0.  \param step  from the call's first.  \param fraction  of the step
  virtual void spiked(std::size_t neuron, int step, double fraction) noexcept = 0;

 protected:
  ~SpikeObserver() = default;
};

}  // namespace merkel
