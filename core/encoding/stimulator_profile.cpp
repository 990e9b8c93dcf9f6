#include "core/encoding/stimulator_profile.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <numeric>
#include <string_view>

#include "core/encoding/encoding_parameters.hpp"
#include "core/units.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

/// Largest multiple of a step that is not above a value; a step of 0 keeps the value. Trying the
/// nearest multiple first keeps multiples as they are.
double floor_to(double value, double step) {
  if (!(step > 0.0)) return value;
  const double nearest = std::round(value / step) * step;
  return nearest <= value ? nearest : std::floor(value / step) * step;
}

bool on_step(nanoseconds time, nanoseconds step) {
  return step.count() <= 0 || time % step == nanoseconds{0};
}

std::string range_text(nanoseconds low, nanoseconds high, nanoseconds step) {
  const std::string steps =
      step.count() > 0 ? " in steps of " + shortest_decimal(units::us_from(step)) : "";
  return shortest_decimal(units::us_from(low)) + " to " + shortest_decimal(units::us_from(high)) +
         " µs" + steps;
}

}  // namespace

FieldTable StimulatorProfile::fields() {
  using P = StimulatorProfile;
  static constexpr Field kFields[] = {
      {"name", "", any_value(), "of the stimulator, for messages", at<&P::name>,
       "commands are not rounded"},
      {"min_amplitude_uA", "µA", not_negative(1e5), "its weakest amplitude but 0",
       at<&P::min_amplitude_uA>},
      {"max_amplitude_uA", "µA", positive(1e5), "its strongest amplitude",
       at<&P::max_amplitude_uA>},
      {"amplitude_step_uA", "µA", not_negative(1e5), "step of amplitudes; 0: any value",
       at<&P::amplitude_step_uA>},
      {"min_frequency_Hz", "Hz", not_negative(1e4), "its lowest frequency but 0",
       at<&P::min_frequency_Hz>},
      {"max_frequency_Hz", "Hz", positive(1e4), "its highest frequency", at<&P::max_frequency_Hz>},
      {"frequency_step_Hz", "Hz", not_negative(1e4), "step of frequencies; 0: any value",
       at<&P::frequency_step_Hz>},
      {"min_phase_us", "µs", positive(1e5), "its shortest phase", at<&P::min_phase>},
      {"max_phase_us", "µs", positive(1e5), "its longest phase", at<&P::max_phase>},
      {"min_interphase_us", "µs", not_negative(1e5), "its shortest time between phases",
       at<&P::min_interphase>},
      {"max_interphase_us", "µs", not_negative(1e5), "its longest time between phases",
       at<&P::max_interphase>},
      {"time_step_us", "µs", not_negative(1e5),
       "step of phases and of the time between them; 0: any value", at<&P::time_step>},
      {"waveforms", "", from_to(1, 65536), "different pulses that it holds at the same time",
       at<&P::waveforms>, "any number"},
      {"asymmetric", "", any_value(), "whether its phases may differ in length",
       at<&P::asymmetric>},
      {"anodic_first", "", any_value(), "whether the anodic phase may come first",
       at<&P::anodic_first>}};
  return {"stimulator", kFields};
}

Expected<void, ParameterError> StimulatorProfile::check(const EncodingParameters& encoding) const {
  ParameterCheck check;
  check.fields(*this);
  if (name.empty()) return check.result();
  const StimulationParameters& p = encoding.stimulation;
  const std::string has = "must be one that the stimulator " + name + " has: ";
  const auto within = [&](nanoseconds time, nanoseconds low, nanoseconds high,
                          const std::string& key) {
    check.require(time >= low && time <= high && on_step(time, time_step), key,
                  has + range_text(low, high, time_step));
  };
  within(p.interphase, min_interphase, max_interphase, "stimulation.interphase_us");
  check.require(
      !waveforms || amplitude_step_uA > 0.0, "stimulator.waveforms",
      "needs an amplitude_step_uA above 0, which is doubled where waveforms do not suffice");
  if (p.second_phase) within(*p.second_phase, min_phase, max_phase, "stimulation.second_phase_us");
  check.require(anodic_first || p.polarity == Polarity::kCathodicFirst, "stimulation.polarity",
                has + "cathodic_first");
  for (const Electrode& each : encoding.electrodes) {
    const ElectrodeLimits limits = ElectrodeLimits::of(each, p);
    within(limits.phase, min_phase, max_phase,
           each.phase ? each.key("phase_us") : "stimulation.phase_us");
    check
        .require(asymmetric || limits.second_phase == limits.phase, "stimulation.second_phase_us",
                 "must be the phase of " + each.name + ", because the stimulator " + name +
                     " has equal phases only: remove it")
        .require(each.amplitude_uA[1] <= max_amplitude_uA, each.key("amplitude_uA"),
                 "reaches " + shortest_decimal(each.amplitude_uA[1]) + " µA, but the stimulator " +
                     name + " ends at " + shortest_decimal(max_amplitude_uA) +
                     ": lower the amplitude")
        .require(each.frequency_Hz[1] <= max_frequency_Hz, each.key("frequency_Hz"),
                 "reaches " + shortest_decimal(each.frequency_Hz[1]) + " Hz, but the stimulator " +
                     name + " ends at " + shortest_decimal(max_frequency_Hz) +
                     ": lower the frequency");
  }
  return check.result();
}

StimulatorSteps::StimulatorSteps(const EncodingParameters& encoding)
    : active_(!encoding.stimulator.name.empty()),
      min_uA_(encoding.stimulator.min_amplitude_uA),
      min_Hz_(encoding.stimulator.min_frequency_Hz),
      step_Hz_(encoding.stimulator.frequency_step_Hz),
      most_waveforms_(encoding.stimulator.waveforms) {
  for (const Electrode& each : encoding.electrodes) {
    const ElectrodeLimits limits = ElectrodeLimits::of(each, encoding.stimulation);
    // The second phase carries phase/second_phase of the current, which must be on a step as well.
    const auto common = std::gcd(limits.phase.count(), limits.second_phase.count());
    const std::int64_t steps = limits.second_phase.count() / common;
    phase_.push_back(limits.phase);
    step_uA_.push_back(static_cast<double>(steps) * encoding.stimulator.amplitude_step_uA);
  }
  seen_.reserve(static_cast<std::size_t>(most_waveforms_.value_or(0)) + 1);
}

StimulationCommand StimulatorSteps::rounded(const StimulationCommand& command,
                                            double coarseness) const noexcept {
  StimulationCommand result = command;
  const bool pulse = command.kind == StimulationCommand::Kind::kPulse;
  result.amplitude_uA = floor_to(command.amplitude_uA, coarseness * step_uA_[command.electrode]);
  if (!pulse) result.frequency_Hz = floor_to(command.frequency_Hz, coarseness * step_Hz_);
  const bool slow = !pulse && (result.frequency_Hz < min_Hz_ || !(result.frequency_Hz > 0.0));
  if (result.amplitude_uA < min_uA_ || !(result.amplitude_uA > 0.0) || slow) {
    result.amplitude_uA = result.frequency_Hz = 0.0;
  }
  return result;
}

bool StimulatorSteps::suffice(std::span<const StimulationCommand> commands,
                              double coarseness) noexcept {
  if (!most_waveforms_) return true;
  seen_.clear();
  for (const StimulationCommand& each : commands) {
    const StimulationCommand result = rounded(each, coarseness);
    if (!(result.amplitude_uA > 0.0)) continue;
    const bool known = std::any_of(seen_.begin(), seen_.end(), [&](const auto& other) {
      return other.amplitude_uA == result.amplitude_uA &&
             other.frequency_Hz == result.frequency_Hz &&
             phase_[other.electrode] == phase_[result.electrode];
    });
    if (known) continue;
    if (std::ssize(seen_) == *most_waveforms_) return false;
    seen_.push_back(result);
  }
  return true;
}

std::size_t StimulatorSteps::round_pulses(std::span<StimulationCommand> pulses) noexcept {
  round_down(pulses);
  const auto end = std::remove_if(pulses.begin(), pulses.end(),
                                  [](const auto& pulse) { return !(pulse.amplitude_uA > 0.0); });
  return static_cast<std::size_t>(end - pulses.begin());
}

void StimulatorSteps::round_down(std::span<StimulationCommand> commands) noexcept {
  if (!active_) return;
  double coarseness = 1.0;
  while (!suffice(commands, coarseness)) coarseness *= 2.0;
  for (StimulationCommand& command : commands) {
    const StimulationCommand before = command;
    command = rounded(before, coarseness);
    if (command == before) continue;
    ++counts_.rounded;
    counts_.largest_uA = std::max(counts_.largest_uA, before.amplitude_uA - command.amplitude_uA);
    counts_.largest_Hz = std::max(counts_.largest_Hz, before.frequency_Hz - command.frequency_Hz);
  }
}

}  // namespace merkel
