#include "drivers/probes/recorded_outputs.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "core/parameters/parameter_error.hpp"
#include "core/units.hpp"
#include "drivers/probes/channel_selection.hpp"
#include "drivers/probes/device_opening.hpp"
#include "drivers/probes/taxel_readings.hpp"
#include "drivers/protocols/csv_columns.hpp"
#include "drivers/sample_channels.hpp"
#include "drivers/sample_limits.hpp"

namespace merkel {

Expected<std::unique_ptr<Probe>, SetupError> RecordedOutputs::split(
    std::unique_ptr<Probe> recording, std::vector<ChannelSelection> parts,
    std::vector<std::string> calibrations) {
  const ProbeInfo whole = recording->info();
  if (parts.empty() && calibrations.empty()) return recording;
  parts.resize(std::max<std::size_t>(parts.size(), 1));
  calibrations.resize(parts.size());
  const auto refuse = [&](const std::string& why) {
    return bad_input("\"" + whole.uri + "\": " + why);
  };
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < kPressChannels.size(); ++i) {
    if (kProbeChannels[i].in(whole.channels)) bits |= bit_of(kPressChannels[i]);
  }
  std::vector<ChannelName> names = names_of_channels(bits);
  std::unique_ptr<RecordedOutputs> outputs(new RecordedOutputs(std::move(recording)));
  for (std::size_t i = 0; i < whole.extra_columns.size(); ++i) {
    const auto column = csv_column_named(whole.extra_columns[i]);
    const bool value = column && column->kind == CsvColumn::Kind::kValue;
    outputs->factors_.push_back(value ? column->factor : 0.0);
    if (!value) continue;
    names.push_back({.name = whole.extra_columns[i],
                     .channel = named_channel(i),
                     .column = 0,
                     .quantity = column->quantity});
  }
  for (std::size_t i = 0; i < names.size(); ++i) names[i].column = i + 1;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const ChannelSelection& wanted = parts[i];
    Array array;
    if (wanted.taxels) {
      array.columns = whole.taxels > 0 ? std::vector<ChannelName>{}
                                       : taxel_channels(names, wanted.taxels->prefix);
      array.area_mm2 = wanted.taxels->area_mm2;
      array.gaps.resize(array.columns.size());
      const std::size_t count = whole.taxels > 0 ? whole.taxels : array.columns.size();
      if (const std::string why = wrong_taxels(count, *wanted.taxels); !why.empty()) {
        return refuse(why);
      }
      ProbeInfo info = whole;
      info.uri += "#" + wanted.text();
      info.channels = ProbeSample::kForce;
      info.extra_columns.clear();
      info.taxels = count;
      outputs->infos_.push_back(std::move(info));
      outputs->calibrations_.emplace_back();
      outputs->arrays_.push_back(std::move(array));
      continue;
    }
    const auto chosen = wanted.among(names);
    if (!chosen) return refuse(chosen.error());
    auto calibration = read_calibration_of_device(calibrations[i], std::nullopt, bits,
                                                  wanted.empty() ? nullptr : &*chosen);
    if (!calibration) return Unexpected<SetupError>(calibration.error());
    outputs->arrays_.push_back(std::move(array));
    ProbeInfo info = whole;
    info.channels = calibration->sample_channels();
    info.calibration_file = calibrations[i];
    info.calibrated = calibration->channels_of_file();
    if (!wanted.empty()) {
      info.uri += "#" + wanted.text();
      info.name += ", " + names_of_channels(*chosen);
      info.extra_columns.clear();
    }
    outputs->infos_.push_back(std::move(info));
    outputs->calibrations_.push_back(std::move(*calibration));
  }
  outputs->watches_.resize(parts.size());
  outputs->faults_.resize(parts.size());
  outputs->valued_.resize(parts.size());
  return outputs;
}

Expected<std::size_t, ProbeError> RecordedOutputs::read(Readings& readings,
                                                        std::chrono::milliseconds patience) {
  readings.clear();
  if (next_ == waiting_.size()) {
    next_ = 0;
    const auto read = ForwardingProbe::read(waiting_, patience);
    readings.take_beside(waiting_);
    if (!read) waiting_.clear();
    if (!read || *read == 0) return read;
  }
  const ProbeColumns& whole = waiting_.columns().of(0);
  DeviceReading reading;
  std::vector<std::string> notices;
  const std::scoped_lock lock(mutex_);
  for (; next_ < waiting_.size() && readings.room() > 0; ++next_) {
    const ProbeSample from = whole.sample(waiting_.head(next_), waiting_.row(next_));
    for (std::size_t i = 0; i < kPressChannels.size(); ++i) {
      reading.set(kPressChannels[i], kProbeChannels[i].of(from));
    }
    const auto further = waiting_.further(next_);
    for (std::size_t i = 0; i < factors_.size(); ++i) {
      reading.set(named_channel(i), further[i] * factors_[i]);
    }
    const std::span<double> row = readings.add(waiting_.head(next_));
    bool saturated = false;
    bool outside = false;
    for (std::size_t i = 0; i < infos_.size(); ++i) {
      const ProbeColumns& columns = readings.columns().of(i);
      ProbeSample sample = infos_[i].taxels > 0
                               ? array_sample(i, reading, next_, columns.taxels_in(row))
                               : calibrations_[i].apply(reading);
      const bool is_saturated = calibrations_[i].saturated(reading);
      const bool is_outside = calibrations_[i].is_outside(sample);
      if (is_outside) sample.set_doubts(sample.doubts() | ProbeSample::kOutsideCalibration);
      watches_[i].take(is_saturated, is_outside, from.time, infos_[i], notices);
      faults_[i].saturated += is_saturated ? 1 : 0;
      faults_[i].outside_calibration += is_outside ? 1 : 0;
      saturated = saturated || is_saturated;
      outside = outside || is_outside;
      const bool valued = plausible(sample);
      if (valued) {
        columns.put(sample, row);
      } else if (valued_[i]) {
        columns.put_nothing(row);
      } else {  // it has had no value yet, so it does not touch
        columns.put({.channels = infos_[i].channels}, row);
      }
      valued_[i] = valued_[i] || valued;
      if (columns.further > 0) std::ranges::copy(further, columns.further_in(row).begin());
    }
    ++counts_.readings;
    if (saturated) ++counts_.saturated;
    if (outside) ++counts_.outside_calibration;
  }
  for (std::string& sentence : notices) add_notice(std::move(sentence));
  return readings.size();
}

ProbeStatus RecordedOutputs::status() const {
  ProbeStatus status = ForwardingProbe::status();
  const std::scoped_lock lock(mutex_);
  if (counts_.saturated + counts_.outside_calibration > 0) status.device = counts_;
  status.faults = faults_;
  return status;
}

/// The sample of an array. Pressures that are out, or no pressures, are 0.
/// \param from  of waiting_. \param kPa  gets the pressures, in single precision
ProbeSample RecordedOutputs::array_sample(std::size_t output, const DeviceReading& reading,
                                          std::size_t from, std::span<double> kPa) {
  Array& array = arrays_[output];
  ProbeSample sample{.channels = ProbeSample::kForce};
  if (array.columns.empty()) {
    std::ranges::copy(waiting_.taxels(from), kPa.begin());
    const ProbeSample whole = *waiting_.sample(from);
    if (whole.has(ProbeSample::kForce)) {
      sample.force_mN = whole.force_mN;
      return sample;
    }
  }
  for (std::size_t i = 0; i < array.columns.size(); ++i) {
    const ChannelName& column = array.columns[i];
    const double value = array.gaps[i].take(reading[column.channel]);
    const double pressure =
        column.quantity == Quantity::kForce ? units::mN_from_N(value) / array.area_mm2 : value;
    const bool touched = pressure > 0.0 && pressure <= SampleLimits::kPressure_kPa;
    kPa[i] = touched ? static_cast<double>(static_cast<float>(pressure)) : 0.0;
  }
  for (const double pressure : kPa) sample.force_mN += pressure * array.area_mm2;
  return sample;
}

}  // namespace merkel
