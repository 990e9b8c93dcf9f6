#include "drivers/probes/port_log.hpp"

#include <algorithm>
#include <cstddef>

namespace merkel {
namespace {

using std::chrono::nanoseconds;

constexpr std::size_t kMaxOfOpening = 4096;

}  // namespace

void PortLog::add(PortListener& listener) {
  const std::scoped_lock lock(mutex_);
  if (dropped_ > 0) listener.missed(dropped_);
  for (const RawFrame& frame : opening_) listener.take(frame);
  listeners_.push_back(&listener);
  idle_.store(false, std::memory_order_release);
}

void PortLog::remove(PortListener& listener) {
  const std::scoped_lock lock(mutex_);
  std::erase(listeners_, &listener);
}

void PortLog::opened(nanoseconds time) {
  if (!idle()) notify({.time = time, .kind = RawFrame::Kind::kOpened});
}

void PortLog::started(nanoseconds time, const ProtocolCounts& counts) {
  reported_ = counts;
  if (!idle()) notify({.time = time, .kind = RawFrame::Kind::kStarted});
}

void PortLog::received(std::span<const std::uint8_t> bytes, nanoseconds arrival,
                       const ProtocolCounts& counts) {
  if (!idle()) {
    notify({.time = arrival,
            .parsed = static_cast<std::uint32_t>(counts.frames - reported_.frames),
            .damaged = static_cast<std::uint32_t>(counts.damaged - reported_.damaged),
            .lost = static_cast<std::uint32_t>(counts.lost - reported_.lost),
            .kind = RawFrame::Kind::kReceived},
           bytes);
  }
  reported_ = counts;
}

void PortLog::sent(std::span<const std::uint8_t> bytes, nanoseconds time) {
  if (!idle()) notify({.time = time, .kind = RawFrame::Kind::kSent}, bytes);
}

void PortLog::notify(RawFrame frame, std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const auto portion = bytes.first(std::min(bytes.size(), RawFrame::kMaxBytes));
    bytes = bytes.subspan(portion.size());
    RawFrame part = frame;
    if (!bytes.empty()) part.parsed = part.damaged = part.lost = 0;
    part.length = static_cast<std::uint8_t>(portion.size());
    std::copy(portion.begin(), portion.end(), part.bytes.begin());
    notify(part);
  }
}

void PortLog::notify(const RawFrame& frame) {
  const std::scoped_lock lock(mutex_);
  for (PortListener* const listener : listeners_) listener->take(frame);
  if (listeners_.empty() && dropped_ == 0 && opening_.size() < kMaxOfOpening) {
    opening_.push_back(frame);
    return;
  }
  ++dropped_;
  if (!listeners_.empty()) return;
  // No listener came, and the record is no longer complete.
  dropped_ += opening_.size();
  opening_ = {};
  idle_.store(true, std::memory_order_release);
}

}  // namespace merkel
