#include "drivers/probes/port_log.hpp"

#include <algorithm>
#include <cstddef>

namespace merkel {
namespace {

using std::chrono::nanoseconds;

constexpr std::size_t kMostOfOpening = 4096;

}  // namespace

void PortLog::add(PortListener& listener) {
  const std::scoped_lock lock(mutex_);
  if (forgotten_ > 0) listener.missed(forgotten_);
  for (const RawFrame& frame : opening_) listener.take(frame);
  listeners_.push_back(&listener);
  idle_.store(false, std::memory_order_release);
}

void PortLog::remove(PortListener& listener) {
  const std::scoped_lock lock(mutex_);
  std::erase(listeners_, &listener);
}

void PortLog::opened(nanoseconds time) {
  if (!idle()) tell({.time = time, .kind = RawFrame::Kind::kOpened});
}

void PortLog::started(nanoseconds time, const ProtocolCounts& counts) {
  told_ = counts;
  if (!idle()) tell({.time = time, .kind = RawFrame::Kind::kStarted});
}

void PortLog::received(std::span<const std::uint8_t> bytes, nanoseconds arrival,
                       const ProtocolCounts& counts) {
  if (!idle()) {
    tell({.time = arrival,
          .parsed = static_cast<std::uint32_t>(counts.frames - told_.frames),
          .damaged = static_cast<std::uint32_t>(counts.damaged - told_.damaged),
          .lost = static_cast<std::uint32_t>(counts.lost - told_.lost),
          .kind = RawFrame::Kind::kReceived},
         bytes);
  }
  told_ = counts;
}

void PortLog::sent(std::span<const std::uint8_t> bytes, nanoseconds time) {
  if (!idle()) tell({.time = time, .kind = RawFrame::Kind::kSent}, bytes);
}

void PortLog::tell(RawFrame frame, std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const auto portion = bytes.first(std::min(bytes.size(), RawFrame::kMostBytes));
    bytes = bytes.subspan(portion.size());
    RawFrame part = frame;
    if (!bytes.empty()) part.parsed = part.damaged = part.lost = 0;
    part.length = static_cast<std::uint8_t>(portion.size());
    std::copy(portion.begin(), portion.end(), part.bytes.begin());
    tell(part);
  }
}

void PortLog::tell(const RawFrame& frame) {
  const std::scoped_lock lock(mutex_);
  for (PortListener* const listener : listeners_) listener->take(frame);
  if (listeners_.empty() && forgotten_ == 0 && opening_.size() < kMostOfOpening) {
    opening_.push_back(frame);
    return;
  }
  ++forgotten_;
  if (!listeners_.empty()) return;
  // No listener came, and the record is no longer complete.
  forgotten_ += opening_.size();
  opening_ = {};
  idle_.store(true, std::memory_order_release);
}

}  // namespace merkel
