#include "realtime/input/probe_input.hpp"

#include <algorithm>

#include "realtime/input/probe_queue.hpp"

namespace merkel {
namespace {

/// How long a sample of a recording without a period of validity is held when the recording ends or
/// goes on without values of the probe.
constexpr std::chrono::nanoseconds kAfterTheEnd{50'000'000};

}  // namespace

ProbeInput::ProbeInput(ProbeQueue& channel, const Parameters& parameters)
    : channel_(channel), parameters_(parameters), mean_(channel.columns().taxels) {
  last_taxels_.resize(channel.columns().taxels);
  taxels_.resize(channel.columns().taxels);
}

const ReadingHead* ProbeInput::consume_until(std::chrono::nanoseconds time) noexcept {
  const ReadingHead* next = channel_.front();
  for (; next != nullptr && next->time <= time; next = channel_.front()) {
    const bool late = next->time <= simulated_;
    (late ? channel_.late : channel_.used).add();
    last_ = channel_.front_sample();
    if (!late && parameters_.decimate == Decimate::kMean) {
      // An array that does not touch has no pressures.
      mean_.add(contact_of(*last_), last_->touch,
                is_out(*last_) ? std::span<const double>{} : channel_.front_taxels());
    }
    if (estimate_) estimate_->add(*last_);
    std::ranges::transform(channel_.front_taxels(), last_taxels_.begin(),
                           [](double kPa) { return static_cast<float>(kPa); });
    channel_.pop();
  }
  return next;
}

bool ProbeInput::ready_for(std::chrono::nanoseconds time) noexcept {
  if (consume_until(time) != nullptr) return true;
  // Readings in which this probe has no value go on for longer than its last sample holds: the next
  // one cannot change the contact. The other probes of the device would wait without end.
  const auto passed = channel_.ring->passed(channel_.place);
  if (last_ && valid_for_last().count() != 0 && passed >= time &&
      passed - last_->time > valid_for_last()) {
    return true;
  }
  // The flag is set after the last sample, so check the queue again after reading the flag.
  if (!channel_.ended.load(std::memory_order_acquire)) return false;
  consume_until(time);
  return true;
}

bool ProbeInput::exhausted() const noexcept {
  return channel_.ended.load(std::memory_order_acquire) && channel_.front() == nullptr;
}

std::optional<std::chrono::nanoseconds> ProbeInput::first_time() const noexcept {
  const ReadingHead* const first = channel_.front();
  return first == nullptr ? std::nullopt : std::optional(first->time);
}

ProbeInput::Counts ProbeInput::counts() const noexcept {
  return {.used = channel_.used.value(),
          .late = channel_.late.value(),
          .held_ticks = channel_.held_ticks.value(),
          .released_ticks = channel_.released_ticks.value()};
}

/// Whether a sample is below the threshold of contact.
bool ProbeInput::is_out(const ProbeSample& sample) const noexcept {
  return sample.touch == Touch::kFree && parameters_.contact.has_threshold();
}

ContactInput ProbeInput::contact_of(const ProbeSample& sample) const noexcept {
  const double force_mN = parameters_.contact.invert_force ? -sample.force_mN : sample.force_mN;
  const bool free = is_out(sample);
  return {.depth_mm = free ? std::min(sample.depth_mm, 0.0) : sample.depth_mm,
          .force_mN = free ? std::min(force_mN, 0.0) : force_mN,
          .x_mm = sample.has(ProbeSample::kX) ? sample.x_mm : parameters_.x_mm,
          .y_mm = sample.has(ProbeSample::kY) ? sample.y_mm : parameters_.y_mm};
}

ContactInput ProbeInput::released(const ContactInput& last) const noexcept {
  return {.depth_mm = 0.0, .force_mN = 0.0, .x_mm = last.x_mm, .y_mm = last.y_mm};
}

ProbeInput::Reading ProbeInput::at(std::chrono::nanoseconds time) noexcept {
  const bool first = simulated_ == std::chrono::nanoseconds::min();
  Reading reading = reading_at(time);
  if (first) mean_.clear();  // they may be of any time before
  if (uses_mean()) reading.contact = mean_.contact();
  reading.touch = touch_of(reading.contact);
  blend_taxels();
  mean_.clear();
  const bool touches = reading.touch == Touch::kTouching;
  if (!touches) touch_began_.reset();
  if (touches && !touch_began_) touch_began_ = time;
  channel_.touch_ns.store(touches ? (time - *touch_began_).count() : 0, std::memory_order_relaxed);
  channel_.depth_mm.store(reading.contact.depth_mm, std::memory_order_relaxed);
  channel_.force_mN.store(reading.contact.force_mN, std::memory_order_relaxed);
  channel_.state.store(reading.state, std::memory_order_relaxed);
  return reading;
}

/// Whether several samples of the tick are averaged; a released probe has none.
bool ProbeInput::uses_mean() const noexcept {
  return mean_.several() && last_share_ + next_share_ > 0.0F;
}

void ProbeInput::blend_taxels() noexcept {
  if (taxels_.empty()) return;
  if (uses_mean()) {
    for (std::size_t i = 0; i < taxels_.size(); ++i) taxels_[i] = mean_.taxel(i);
    return;
  }
  if (last_ && is_out(*last_)) last_share_ = 0.0F;
  if (next_share_ > 0.0F && is_out(channel_.front_sample())) next_share_ = 0.0F;
  // The next sample exists only if it has a share.
  const std::span<const double> next =
      next_share_ > 0.0F ? channel_.front_taxels() : std::span<const double>{};
  for (std::size_t i = 0; i < taxels_.size(); ++i) {
    const float after = next.empty() ? last_taxels_[i] : static_cast<float>(next[i]);
    taxels_[i] = last_share_ * last_taxels_[i] + next_share_ * after;
  }
}

/// The touch of a reading is that of its samples, unless it has none yet.
Touch ProbeInput::touch_of(const ContactInput& contact) const noexcept {
  if (!(contact.depth_mm > 0.0 || contact.force_mN > 0.0)) return Touch::kFree;
  Touch touch = last_ && last_share_ > 0.0F ? last_->touch : Touch::kUndecided;
  // The next sample exists only if it has a share.
  if (next_share_ > 0.0F) touch = std::max(touch, channel_.front_sample().touch);
  if (uses_mean()) touch = mean_.touch();
  return touch == Touch::kUndecided ? Touch::kTouching : touch;
}

ProbeInput::Reading ProbeInput::reading_at(std::chrono::nanoseconds time) noexcept {
  consume_until(time);
  const bool ended = channel_.ended.load(std::memory_order_acquire);
  // A sample may have arrived just before the flag was set.
  const ReadingHead* const next = consume_until(time);
  simulated_ = time;
  last_share_ = next_share_ = 0.0F;

  if (!last_) {
    if (next != nullptr) {
      next_share_ = 1.0F;
      const ProbeSample first = channel_.front_sample();
      return {contact_of(first), State::kFollowing, first.doubts()};
    }
    channel_.released_ticks.add();
    return {{.x_mm = parameters_.x_mm, .y_mm = parameters_.y_mm}, State::kReleased};
  }
  const ContactInput before = contact_of(*last_);
  last_share_ = 1.0F;
  if (last_->time == time) return {before, State::kFollowing, last_->doubts()};
  const auto valid_for = valid_for_last();
  const bool unlimited = valid_for.count() == 0;
  if (next != nullptr && (unlimited || next->time - last_->time <= valid_for)) {
    if (!parameters_.interpolate) return {before, State::kFollowing, last_->doubts()};
    const ProbeSample later = channel_.front_sample();
    const ContactInput after = contact_of(later);
    const double fraction = static_cast<double>((time - last_->time).count()) /
                            static_cast<double>((next->time - last_->time).count());
    next_share_ = static_cast<float>(fraction);
    last_share_ = 1.0F - next_share_;
    const auto between = [fraction](double a, double b) { return a + (b - a) * fraction; };
    return {{.depth_mm = between(before.depth_mm, after.depth_mm),
             .force_mN = between(before.force_mN, after.force_mN),
             .x_mm = between(before.x_mm, after.x_mm),
             .y_mm = between(before.y_mm, after.y_mm)},
            State::kFollowing,
            static_cast<std::uint8_t>(last_->doubts() | later.doubts())};
  }
  const bool over = ended && next == nullptr;
  if (time - last_->time > (unlimited ? kAfterTheEnd : valid_for) && (over || !unlimited)) {
    if (!over) channel_.released_ticks.add();
    last_share_ = 0.0F;
    return {released(before), over ? State::kEnded : State::kReleased};
  }
  // Without interpolation, only the newest sample is needed.
  if (!over && !parameters_.interpolate) {
    return {before, State::kFollowing, last_->doubts()};
  }
  if (!over) channel_.held_ticks.add();
  return {before, over ? State::kEnded : State::kHeld, last_->doubts()};
}

std::chrono::nanoseconds ProbeInput::valid_for_last() const noexcept {
  const auto valid_for = parameters_.stale_after.value_or(last_->valid_for);
  const bool without_value = channel_.ring->passed(channel_.place) > last_->time;
  return valid_for.count() == 0 && without_value ? kAfterTheEnd : valid_for;
}

}  // namespace merkel
