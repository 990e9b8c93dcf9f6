#include "drivers/probes/played_probe.hpp"

#include <algorithm>
#include <chrono>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "drivers/probes/forwarding_probe.hpp"

namespace merkel {
namespace {

constexpr std::chrono::milliseconds kUnknownSamplePeriod{1};
constexpr std::size_t kAhead = 256;

class RepeatedProbe final : public Probe {
 public:
  using Open = std::function<Expected<std::unique_ptr<Probe>, SetupError>()>;

  /// \param first  the first round. \param open  opens each further one
  /// \param rounds  0: without end
  RepeatedProbe(std::unique_ptr<Probe> first, Open open, std::uint64_t rounds)
      : info_(first->info()),
        open_(std::move(open)),
        left_(rounds > 0 ? rounds - 1 : 0),
        endless_(rounds == 0),
        round_(std::move(first)) {}

  [[nodiscard]] std::span<const ProbeInfo> outputs() const noexcept override { return {&info_, 1}; }
  [[nodiscard]] std::string error_message() const override {
    return error_message_.empty() ? round_->error_message() : error_message_;
  }
  [[nodiscard]] std::vector<std::string> take_notices() override {
    const std::scoped_lock lock(mutex_);
    return std::exchange(notices_, {});
  }

  [[nodiscard]] Expected<std::size_t, ProbeError> read(
      Readings& readings, std::chrono::milliseconds patience) override {
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

 private:
  bool start_again() {
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

  ProbeInfo info_;
  Open open_;
  std::uint64_t left_;  ///< rounds after this one
  bool endless_;
  std::unique_ptr<Probe> round_;
  std::optional<std::chrono::nanoseconds> first_;  ///< time of its first sample, as recorded
  std::chrono::nanoseconds last_{0};               ///< time of the last sample
  std::chrono::nanoseconds shift_{0};              ///< of this round
  std::uint32_t next_sequence_ = 0;
  std::string error_message_;
  std::mutex mutex_;  ///< guards notices_
  std::vector<std::string> notices_;
};

std::chrono::nanoseconds now() noexcept {
  return std::chrono::steady_clock::now().time_since_epoch();
}

class LiveProbe final : public ForwardingProbe {
 public:
  explicit LiveProbe(std::unique_ptr<Probe> recording)
      : ForwardingProbe(std::move(recording)),
        info_(ForwardingProbe::outputs().front()),
        ahead_(columns_of(ForwardingProbe::outputs()), kAhead) {
    info_.name += ", live";
    info_.replayed = false;
  }

  [[nodiscard]] std::span<const ProbeInfo> outputs() const noexcept override { return {&info_, 1}; }

  [[nodiscard]] Expected<std::size_t, ProbeError> read(
      Readings& readings, std::chrono::milliseconds patience) override {
    readings.clear();
    if (next_ == ahead_.size()) {
      next_ = 0;
      const auto count = ForwardingProbe::read(ahead_, patience);
      if (!count) ahead_.clear();
      if (!count || *count == 0) {
        readings.take_beside(ahead_, shift_.value_or(std::chrono::nanoseconds{0}));
        return count;
      }
    }
    if (!shift_) shift_ = now() - ahead_.head(0).time;
    const auto first_taken = ahead_.head(next_).time + *shift_;
    const auto until = std::min(first_taken, now() + patience);
    std::this_thread::sleep_until(std::chrono::steady_clock::time_point(until));

    const auto arrival = now();
    const std::size_t first = next_;
    while (next_ - first < readings.room() && next_ < ahead_.size() &&
           ahead_.head(next_).time + *shift_ <= arrival) {
      ++next_;
    }
    readings.add(ahead_, first, next_ - first);
    readings.take_beside(ahead_, *shift_);
    for (ReadingHead& head : readings.heads()) {
      head.time += *shift_;
      head.arrival = arrival;
    }
    return readings.size();
  }

 private:
  ProbeInfo info_;
  Readings ahead_;                                 ///< read, but not yet due
  std::size_t next_ = 0;                           ///< next one of `ahead_`
  std::optional<std::chrono::nanoseconds> shift_;  ///< host time − the recording's time
};

}  // namespace

Expected<std::unique_ptr<Probe>, SetupError> play(
    const Uri& uri, Expected<std::unique_ptr<Probe>, SetupError> (*open)(const Uri&)) {
  Uri recording = uri;
  Uri pace = uri;
  pace.options.clear();
  for (const char* key : {"live", "repeat"}) {
    if (auto option = recording.options.extract(key)) pace.options.insert(std::move(option));
  }
  UriOptions options(pace);
  const bool live = options.whole("live", 0, 0, 1) == 1;
  const std::int64_t rounds = options.whole("repeat", 1, 0, 1'000'000'000);
  if (auto done = options.finish(); !done) return Unexpected<SetupError>(done.error());
  auto probe = open(recording);
  if (!probe) return probe;
  if (rounds != 1) {
    probe = std::make_unique<RepeatedProbe>(
        std::move(*probe), [recording, open] { return open(recording); },
        static_cast<std::uint64_t>(rounds));
  }
  if (!live) return probe;
  return std::make_unique<LiveProbe>(std::move(*probe));
}

}  // namespace merkel
