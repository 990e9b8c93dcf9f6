#include "realtime/input/probe_input.hpp"

#include <algorithm>

#include "core/units.hpp"
#include "realtime/input/probe_channel.hpp"

namespace merkel {
namespace {

/// How long the last sample of a recording is held if it has no period of validity.
constexpr std::chrono::nanoseconds kAfterTheEnd{50'000'000};

}  // namespace

ProbeInput::ProbeInput(ProbeChannel& channel, const Parameters& parameters)
    : channel_(channel), parameters_(parameters) {
  last_taxels_.resize(channel.columns().taxels);
  taxels_.resize(channel.columns().taxels);
}

void ProbeInput::consume_until(std::chrono::nanoseconds time) noexcept {
  for (const ReadingHead* next = channel_.front(); next != nullptr && next->time <= time;
       next = channel_.front()) {
    (next->time <= simulated_ ? channel_.late : channel_.used).add();
    last_ = channel_.front_sample();
    if (estimate_) estimate_->add(*last_);
    std::ranges::transform(channel_.front_taxels(), last_taxels_.begin(),
                           [](double kPa) { return static_cast<float>(kPa); });
    channel_.pop();
  }
}

bool ProbeInput::ready_for(std::chrono::nanoseconds time) noexcept {
  consume_until(time);
  if (channel_.front() != nullptr) return true;
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

ContactInput ProbeInput::contact_of(const ProbeSample& sample) const noexcept {
  return {.depth_mm = sample.depth_mm,
          .force_mN = parameters_.invert_force ? -sample.force_mN : sample.force_mN,
          .x_mm = sample.has(ProbeSample::kX) ? sample.x_mm : parameters_.x_mm,
          .y_mm = sample.has(ProbeSample::kY) ? sample.y_mm : parameters_.y_mm};
}

ContactInput ProbeInput::released(const ContactInput& last) const noexcept {
  return {.depth_mm = 0.0, .force_mN = 0.0, .x_mm = last.x_mm, .y_mm = last.y_mm};
}

ProbeInput::Reading ProbeInput::at(std::chrono::nanoseconds time) noexcept {
  Reading reading = reading_at(time);
  if (parameters_.contact_N > 0.0 && last_ && last_->has(ProbeSample::kForce)) {
    apply_threshold(reading.contact);
    if (!touching_) last_share_ = next_share_ = 0.0F;
  }
  blend_taxels();
  const bool touches = reading.contact.depth_mm > 0.0 || reading.contact.force_mN > 0.0;
  if (!touches) touch_began_.reset();
  if (touches && !touch_began_) touch_began_ = time;
  channel_.touch_ns.store(touches ? (time - *touch_began_).count() : 0, std::memory_order_relaxed);
  channel_.depth_mm.store(reading.contact.depth_mm, std::memory_order_relaxed);
  channel_.force_mN.store(reading.contact.force_mN, std::memory_order_relaxed);
  channel_.state.store(reading.state, std::memory_order_relaxed);
  return reading;
}

void ProbeInput::blend_taxels() noexcept {
  if (taxels_.empty()) return;
  // The next sample exists only if it has a share.
  const std::span<const double> next =
      next_share_ > 0.0F ? channel_.front_taxels() : std::span<const double>{};
  for (std::size_t i = 0; i < taxels_.size(); ++i) {
    const float after = next.empty() ? last_taxels_[i] : static_cast<float>(next[i]);
    taxels_[i] = last_share_ * last_taxels_[i] + next_share_ * after;
  }
}

void ProbeInput::apply_threshold(ContactInput& contact) noexcept {
  touching_ = contact.force_mN >= (touching_ ? 0.5 : 1.0) * units::mN_from_N(parameters_.contact_N);
  if (touching_) return;
  contact.force_mN = std::min(contact.force_mN, 0.0);
  contact.depth_mm = std::min(contact.depth_mm, 0.0);
}

ProbeInput::Reading ProbeInput::reading_at(std::chrono::nanoseconds time) noexcept {
  consume_until(time);
  const bool ended = channel_.ended.load(std::memory_order_acquire);
  consume_until(time);  // a sample may have arrived just before the flag was set
  simulated_ = time;
  const ReadingHead* const next = channel_.front();
  last_share_ = next_share_ = 0.0F;

  if (!last_) {
    if (next != nullptr) {
      next_share_ = 1.0F;
      return {contact_of(channel_.front_sample()), State::kFollowing};
    }
    channel_.released_ticks.add();
    return {{.x_mm = parameters_.x_mm, .y_mm = parameters_.y_mm}, State::kReleased};
  }
  const ContactInput before = contact_of(*last_);
  last_share_ = 1.0F;
  if (last_->time == time) return {before, State::kFollowing};
  const auto valid_for = valid_for_last();
  const bool unlimited = valid_for.count() == 0;
  if (next != nullptr && (unlimited || next->time - last_->time <= valid_for)) {
    if (!parameters_.interpolate) return {before, State::kFollowing};
    const ContactInput after = contact_of(channel_.front_sample());
    const double fraction = static_cast<double>((time - last_->time).count()) /
                            static_cast<double>((next->time - last_->time).count());
    next_share_ = static_cast<float>(fraction);
    last_share_ = 1.0F - next_share_;
    const auto between = [fraction](double a, double b) { return a + (b - a) * fraction; };
    return {{.depth_mm = between(before.depth_mm, after.depth_mm),
             .force_mN = between(before.force_mN, after.force_mN),
             .x_mm = between(before.x_mm, after.x_mm),
             .y_mm = between(before.y_mm, after.y_mm)},
            State::kFollowing};
  }
  const bool over = ended && next == nullptr;
  if (time - last_->time > (unlimited ? kAfterTheEnd : valid_for) && (over || !unlimited)) {
    if (!over) channel_.released_ticks.add();
    last_share_ = 0.0F;
    return {released(before), over ? State::kEnded : State::kReleased};
  }
  // Without interpolation, only the newest sample is needed.
  if (!over && !parameters_.interpolate) return {before, State::kFollowing};
  if (!over) channel_.held_ticks.add();
  return {before, over ? State::kEnded : State::kHeld};
}

std::chrono::nanoseconds ProbeInput::valid_for_last() const noexcept {
  return parameters_.stale_after.value_or(last_->valid_for);
}

}  // namespace merkel
