#include "realtime/output/spike_consumer.hpp"

#include "realtime/output/fanout.hpp"

namespace merkel {

bool SpikeConsumer::try_pop(SpikeEvent& spike) noexcept {
  return channel_->feed<SpikeEvent>().try_pop(spike);
}

bool SpikeConsumer::ended() const noexcept {
  return channel_->ended.load(std::memory_order_acquire);
}

std::uint64_t SpikeConsumer::dropped() const noexcept { return channel_->dropped<SpikeEvent>(); }

void SpikeConsumer::wait() noexcept { channel_->beat.wait(seen_); }

}  // namespace merkel
