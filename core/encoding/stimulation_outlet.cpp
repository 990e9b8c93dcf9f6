#include "core/encoding/stimulation_outlet.hpp"

#include <algorithm>

#include "core/units.hpp"

namespace merkel {

StimulationOutlet::StimulationOutlet(const EncodingParameters& parameters) : steps_(parameters) {
  for (const Electrode& each : parameters.electrodes) {
    max_slope_uA_per_s_.push_back(
        ElectrodeLimits::of(each, parameters.stimulation).max_slope_uA_per_s);
  }
  last_uA_.resize(max_slope_uA_per_s_.size());
  base_uA_.resize(max_slope_uA_per_s_.size());
}

std::span<const SentCommand> StimulationOutlet::pass(std::span<const SentCommand> sent, Time now) {
  leaving_.clear();
  refused_.clear();
  for (const SentCommand& each : sent) {
    if (each.command.kind == StimulationCommand::Kind::kPulse) {
      pass_pulse(each, now);
      continue;
    }
    if (each.command.electrode != update_.size()) {  // a part of an update was lost
      lost_ = true;
      refused_.insert(refused_.end(), update_.begin(), update_.end());
      update_.clear();
      if (each.command.electrode != 0) {
        refused_.push_back(each);
        continue;
      }
    }
    update_.push_back(each);
    if (update_.size() < last_uA_.size()) continue;
    pass_update(now);
    update_.clear();
  }
  return leaving_;
}

void StimulationOutlet::pass_pulse(const SentCommand& pulse, Time now) {
  missed_ = missed_ || now - pulse.sent > kPatience;
  SentCommand out = pulse;
  limit(out.command, now);
  const bool on = !lost_ && !missed_ && out.command.amplitude_uA > 0.0;
  (on ? leaving_ : refused_).push_back(on ? out : pulse);
}

void StimulationOutlet::pass_update(Time now) {
  const bool late = now - update_.front().sent > kPatience;
  const auto stops = [](const SentCommand& each) {
    return each.command.stop != StimulationCommand::Stop::kNone;
  };
  if (late && std::none_of(update_.begin(), update_.end(), stops)) {
    missed_ = true;
    refused_.insert(refused_.end(), update_.begin(), update_.end());
    return;
  }
  const bool off = late || lost_ || (missed_ && now > valid_until_);
  if (off) {
    std::fill(base_uA_.begin(), base_uA_.end(), 0.0);
    since_ = now;
  } else if (missed_) {
    base_uA_ = last_uA_;
    since_ = last_;
  }
  missed_ = lost_ = false;
  for (SentCommand& each : update_) {
    if (off && !stops(each)) {
      if (each.command.amplitude_uA > 0.0) refused_.push_back(each);
      each.command.amplitude_uA = each.command.frequency_Hz = 0.0;
      each.command.stop = StimulationCommand::Stop::kSinkFailure;
    }
    limit(each.command, now);
    last_uA_[each.command.electrode] = each.command.amplitude_uA;
    leaving_.push_back(each);
  }
  last_ = now;
  valid_until_ = update_.front().valid_until;
}

void StimulationOutlet::limit(StimulationCommand& command, Time now) noexcept {
  if (!since_) return;
  // The gate's amplitudes rise no faster than the slope, so the smaller of both does neither. An
  // infinite slope limits nothing, also after no time: the comparison with NaN is false.
  const double highest_uA =
      base_uA_[command.electrode] +
      max_slope_uA_per_s_[command.electrode] * units::s_from(std::max(now - *since_, Time{0}));
  if (!(command.amplitude_uA > highest_uA)) return;
  command.amplitude_uA = highest_uA;
  steps_.round_down({&command, 1});
  if (!(command.amplitude_uA > 0.0)) command.frequency_Hz = 0.0;
}

}  // namespace merkel
