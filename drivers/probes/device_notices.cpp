#include "drivers/probes/device_notices.hpp"

#include <utility>

#include "drivers/printable_text.hpp"

namespace merkel {
namespace {

constexpr std::size_t kMaxLength = 8000;  ///< far beyond a shortened sentence

}  // namespace

void DeviceNotices::add(const std::string& sentence, std::chrono::nanoseconds now) {
  const std::scoped_lock lock(mutex_);
  if (now - second_ >= std::chrono::seconds{1}) {
    second_ = now;
    passed_ = 0;
    if (dropped_ > 0 && sentences_.size() < kMax) {
      sentences_.push_back(std::to_string(std::exchange(dropped_, 0)) +
                           " more notices of its device were suppressed");
    }
  }
  if (passed_ >= kPerSecond || sentences_.size() >= kMax) {
    ++dropped_;
    return;
  }
  ++passed_;
  sentences_.push_back(printable_text(shortened(sentence), kMaxLength));
}

void DeviceNotices::dropped(std::uint64_t count) {
  const std::scoped_lock lock(mutex_);
  dropped_ += count;
}

std::vector<std::string> DeviceNotices::take() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(sentences_, {});
}

}  // namespace merkel
