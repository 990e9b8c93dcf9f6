#include "core/encoding/stimulation_outlet.hpp"

#include <algorithm>

#include "core/units.hpp"

namespace merkel {

using Kind = StimulationCommand::Kind;
using Stop = StimulationCommand::Stop;

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
    SentCommand out = each;
    if (each.command.kind == Kind::kPulse) {
      missed_ = missed_ || now - each.sent > kPatience;
      limit(out.command, now);
      const bool on = !lost_ && !missed_ && out.command.amplitude_uA > 0.0;
      (on ? leaving_ : refused_).push_back(on ? out : each);
      continue;
    }
    if (each.command.electrode == 0) update_ = treatment_of_update(each, now);
    const bool stops = each.command.stop != Stop::kNone;
    if (update_ == Treatment::kRefuse && !stops) {
      refused_.push_back(each);
      continue;
    }
    if (update_ == Treatment::kOff && !stops) {
      if (each.command.amplitude_uA > 0.0) refused_.push_back(each);
      out.command.amplitude_uA = out.command.frequency_Hz = 0.0;
      out.command.stop = Stop::kSinkFailure;
    }
    limit(out.command, now);
    if (each.command.electrode < last_uA_.size()) {
      last_uA_[each.command.electrode] = out.command.amplitude_uA;
    }
    last_ = now;
    valid_until_ = each.valid_until;
    leaving_.push_back(out);
  }
  return leaving_;
}

StimulationOutlet::Treatment StimulationOutlet::treatment_of_update(const SentCommand& first,
                                                                    Time now) noexcept {
  if (now - first.sent > kPatience) {
    missed_ = true;
    return Treatment::kRefuse;
  }
  const bool off = lost_ || (missed_ && now > valid_until_);
  if (off) {
    std::fill(base_uA_.begin(), base_uA_.end(), 0.0);
    since_ = now;
  } else if (missed_) {
    base_uA_ = last_uA_;
    since_ = last_;
  }
  missed_ = lost_ = false;
  return off ? Treatment::kOff : Treatment::kPass;
}

void StimulationOutlet::limit(StimulationCommand& command, Time now) noexcept {
  if (!since_ || command.electrode >= max_slope_uA_per_s_.size()) return;
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
