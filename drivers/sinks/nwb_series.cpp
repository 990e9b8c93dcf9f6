#include "drivers/sinks/nwb_series.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>

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

TimeSeries::Description current(const NwbContent::Electrode& electrode, const std::string& what) {
  return {.unit = "amperes",
          .conversion = 1e-6F,
          .description = "electrode " + electrode.name + ": " + what,
          .comments = electrode.description};
}

/// From the decimals of a force: a change of unit adds no rounding error.
double value_of(const SampleChannel& channel, const ProbeSample& sample) {
  const double value = sample.*channel.member;
  return channel.power == 0 ? value
                            : parse_number(shortest_decimal(value), channel.power).value_or(0.0);
}

}  // namespace

std::string name_of_probe(std::size_t number) { return "probe_" + std::to_string(number); }

ProbeSeries::ProbeSeries(Hdf5File& file, SeriesPaths& paths, const NwbContent::Probe& probe,
                         std::size_t number, bool only)
    : known_(probe.channels), number_(number) {
  for (const NwbContent::Channel& channel : probe.channels) {
    const std::string path =
        paths.take(only ? channel.name : name_of_probe(number) + "_" + channel.name);
    const TimeSeries::Description description{.unit = channel.unit,
                                              .conversion = channel.conversion,
                                              .description = channel.meaning,
                                              .comments = "measured by " + probe.name};
    channels_.push_back(channels_.empty() ? std::make_unique<TimeSeries>(file, path, description)
                                          : std::make_unique<TimeSeries>(file, path, description,
                                                                         *channels_.front()));
  }
}

void ProbeSeries::add(double time_s, const DeliveredSample& item, std::vector<Interval>& contacts) {
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    const NwbContent::Channel& channel = known_[i];
    const double value = channel.press != nullptr ? value_of(*channel.press, item.sample)
                         : channel.extra < item.further.size()
                             ? item.further[channel.extra]
                             : std::numeric_limits<double>::quiet_NaN();
    channels_[i]->append(time_s, value);
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

ElectrodeSeries::ElectrodeSeries(Hdf5File& file, SeriesPaths& paths,
                                 const NwbContent::Electrode& electrode, Of of)
    : electrode_(electrode),
      of_(of),
      amplitude_(
          file, paths.take(name("amplitude")),
          current(electrode, verb() + " amplitude of one phase, in µA; 0: off; each value holds "
                                      "until the next one")),
      frequency_(file, paths.take(name("frequency")),
                 {.unit = "hertz",
                  .conversion = 1.0F,
                  .description = "electrode " + electrode.name + ": " + verb() +
                                 " frequency of the pulse train, in Hz; each value "
                                 "holds until the next one",
                  .comments = electrode.description},
                 amplitude_),
      stops_(file, paths.take(name("stop")),
             {.unit = "n.a.",
              .conversion = 1.0F,
              .description =
                  "electrode " + electrode.name + ": why it was switched off: " + stop_codes(),
              .comments = electrode.description},
             amplitude_),
      pulses_(file, paths.take(name("pulses")),
              current(electrode, "amplitude of one phase of each single pulse, in µA")) {
  if (of_ != Of::kSent) return;
  sent_ = std::make_unique<TimeSeries>(
      file, paths.take(name("monotonic")),
      TimeSeries::Description{.unit = "seconds",
                              .conversion = 1.0F,
                              .description = "electrode " + electrode.name +
                                             ": when the command passed the gate to the receivers, "
                                             "on the monotonic clock of the machine",
                              .comments = electrode.description},
      amplitude_);
}

std::string ElectrodeSeries::verb() const { return of_ == Of::kSent ? "sent" : "commanded"; }

std::string ElectrodeSeries::name(const char* quantity) const {
  return "electrode_" + electrode_.name + (of_ == Of::kSent ? "_sent_" : "_") + quantity;
}

void ElectrodeSeries::add(double time_s, const StimulationCommand& command,
                          std::chrono::nanoseconds sent) {
  if (command.kind == StimulationCommand::Kind::kPulse) {
    pulses_.append(time_s, command.amplitude_uA);
    return;
  }
  amplitude_.append(time_s, command.amplitude_uA);
  frequency_.append(time_s, command.frequency_Hz);
  stops_.append(time_s, static_cast<double>(command.stop));
  if (sent_) sent_->append(time_s, units::s_from(sent));
}

}  // namespace merkel::nwb
