#include "drivers/probes/repeated_probe.hpp"

#include <utility>

namespace merkel {
namespace {

constexpr std::chrono::milliseconds kUnknownSamplePeriod{1};

}  // namespace

RepeatedProbe::RepeatedProbe(std::unique_ptr<Probe> first, Open open, std::uint64_t rounds)
    : info_(first->info()),
      open_(std::move(open)),
      left_(rounds > 0 ? rounds - 1 : 0),
      endless_(rounds == 0),
      round_(std::move(first)) {}

Expected<std::size_t, ProbeError> RepeatedProbe::read(Readings& readings,
                                                      std::chrono::milliseconds patience) {
  auto count = round_->read(readings, patience);
  if (!count && count.error() == ProbeError::kEndOfStream && first_ && (endless_ || left_ > 0)) {
    if (!start_again()) return Unexpected<ProbeError>(ProbeError::kBadData);
    count = round_->read(readings, patience);
  }
  if (!count) return count;
  for (ReadingHead& head : readings.heads()) {
    if (!first_) first_ = head.time;
    head.time += shift_;
    head.arrival += shift_;
    head.sequence = next_sequence_++;
    last_ = head.time;
  }
  readings.shift_beside(shift_);
  if (auto notices = round_->take_notices(); !notices.empty()) {
    const std::scoped_lock lock(mutex_);
    notices_.insert(notices_.end(), notices.begin(), notices.end());
  }
  return count;
}

bool RepeatedProbe::start_again() {
  auto again = open_();
  if (!again) {
    error_message_ = again.error().sentence;
    return false;
  }
  round_ = std::move(*again);
  if (!endless_) --left_;
  shift_ = last_ + info_.period.value_or(kUnknownSamplePeriod) - *first_;
  return true;
}

std::vector<std::string> RepeatedProbe::take_notices() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(notices_, {});
}

}  // namespace merkel
