#include "drivers/sinks/nwb_series.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include "core/parameters/parameter_error.hpp"
#include "core/units.hpp"
#include "drivers/files/csv_text.hpp"

namespace merkel::nwb {
namespace {

using Stop = StimulationCommand::Stop;

/// "0 no stop, 1 released, …"
std::string stop_codes() {
  std::string codes = "0 no stop";
  for (int stop = 1; stop <= static_cast<int>(Stop::kLast); ++stop) {
    codes += ", " + std::to_string(stop) + " ";
    codes += name_of(static_cast<Stop>(stop));
  }
  return codes;
}

constexpr std::array<const char*, kProbeChannels.size()> kNwbMeanings = {
    "indentation depth, in mm", "normal force, in N",
    "position on the patch along the finger, in mm",
    "position on the patch across the finger, in mm"};

/// The field of an electrode.
std::string text_of(const Electrode& electrode, const StimulationParameters& scene) {
  return "field of radius " + shortest_decimal(electrode.field_mm[2]) +
         " mm around x = " + shortest_decimal(electrode.field_mm[0]) +
         " mm, y = " + shortest_decimal(electrode.field_mm[1]) + " mm on patch " +
         std::to_string(electrode.patch) + "; one phase lasts " +
         // The whole phase that the device sends, as every other sink has it.
         shortest_decimal(units::us_from(ElectrodeLimits::of(electrode, scene).phase)) + " µs";
}

/// From the decimals of a force: a change of unit adds no rounding error.
double value_of(const SampleChannel& channel, const ProbeSample& sample) {
  const double value = sample.*channel.member;
  return channel.power == 0 ? value
                            : parse_number(shortest_decimal(value), channel.power).value_or(0.0);
}

}  // namespace

std::string name_of_probe(std::size_t number) { return "probe_" + std::to_string(number); }

ProbeSeries::ProbeSeries(Hdf5File& file, SeriesPaths& paths, const ProbeInfo& probe,
                         std::size_t number, bool only)
    : number_(number) {
  const auto add_series = [&](const std::string& name, const char* unit, float conversion,
                              const std::string& meaning) {
    series_.push_back(std::make_unique<TimeSeries>(
        file, paths.take(only ? name : name_of_probe(number) + "_" + name),
        TimeSeries::Description{.unit = unit,
                                .conversion = conversion,
                                .description = meaning,
                                .comments = "measured by " + probe.title()},
        series_.empty() ? nullptr : series_.front().get()));
  };
  for (std::size_t i = 0; i < kProbeChannels.size(); ++i) {
    const SampleChannel& channel = kProbeChannels[i];
    if (!channel.in(probe.channels)) continue;
    const bool force = channel.bit == ProbeSample::kForce;
    press_.push_back(&channel);
    add_series(std::string(channel.name), force ? "newtons" : "meters", force ? 1.0F : 1e-3F,
               kNwbMeanings[i]);
  }
  for (const std::string& name : probe.extra_columns) {
    add_series(name, "unknown", 1.0F,
               "the column \"" + name + "\" of the recording, not used by the model");
  }
}

void ProbeSeries::add(double time_s, const DeliveredSample& item, std::vector<Interval>& contacts) {
  for (std::size_t i = 0; i < series_.size(); ++i) {
    const std::size_t further = i - press_.size();
    series_[i]->append(time_s, i < press_.size()               ? value_of(*press_[i], item.sample)
                               : further < item.further.size() ? item.further[further]
                                                               : std::nan(""));
  }
  const bool contact = touches(item.sample);
  if (contact && !touched_s_) touched_s_ = time_s;
  if (!contact) end_contact(time_s, contacts);
}

void ProbeSeries::end_contact(double time_s, std::vector<Interval>& contacts) {
  if (!touched_s_) return;
  contacts.push_back({.start_s = *touched_s_,
                      .stop_s = time_s,
                      .label = "contact",
                      .subject = name_of_probe(number_)});
  touched_s_.reset();
}

ElectrodeSeries::ElectrodeSeries(Hdf5File& file, SeriesPaths& paths, const Electrode& electrode,
                                 const StimulationParameters& scene, Of of) {
  const bool sent = of == Of::kSent;
  const std::string verb = sent ? "sent" : "commanded";
  const auto series = [&](const char* quantity, const char* unit, float conversion,
                          const std::string& what) {
    return std::make_unique<TimeSeries>(
        file, paths.take("electrode_" + electrode.name + (sent ? "_sent_" : "_") + quantity),
        TimeSeries::Description{.unit = unit,
                                .conversion = conversion,
                                .description = "electrode " + electrode.name + ": " + what,
                                .comments = text_of(electrode, scene)},
        amplitude_.get());
  };
  pulses_ = series("pulses", "amperes", 1e-6F,  // at times of their own
                   "amplitude of one phase of each single pulse, in µA");
  amplitude_ = series("amplitude", "amperes", 1e-6F,
                      verb +
                          " amplitude of one phase, in µA; 0: off; each value holds until the "
                          "next one");
  frequency_ = series("frequency", "hertz", 1.0F,
                      verb +
                          " frequency of the pulse train, in Hz; each value holds until the next "
                          "one");
  stops_ = series("stop", "n.a.", 1.0F, "why it was switched off: " + stop_codes());
  if (!sent) return;
  sent_ = series("monotonic", "seconds", 1.0F,
                 "when the command passed the gate to the receivers, on the monotonic clock of the "
                 "machine");
}

void ElectrodeSeries::add(double time_s, const StimulationCommand& command,
                          std::chrono::nanoseconds sent) {
  if (command.kind == StimulationCommand::Kind::kPulse) {
    pulses_->append(time_s, command.amplitude_uA);
    return;
  }
  amplitude_->append(time_s, command.amplitude_uA);
  frequency_->append(time_s, command.frequency_Hz);
  stops_->append(time_s, static_cast<double>(command.stop));
  if (sent_) sent_->append(time_s, units::s_from(sent));
}

}  // namespace merkel::nwb
