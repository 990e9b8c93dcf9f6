#include "drivers/probes/recorded_outputs.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "core/parameters/parameter_error.hpp"
#include "core/units.hpp"
#include "drivers/probes/probe_channels.hpp"
#include "drivers/probes/taxel_readings.hpp"
#include "drivers/protocols/csv_columns.hpp"
#include "drivers/sample_limits.hpp"

namespace merkel {
namespace {

constexpr std::size_t kAtOnce = 256;

constexpr std::array<std::pair<std::uint32_t, DeviceChannel>, 4> kTraceChannels = {
    {{ProbeSample::kDepth, DeviceChannel::kDepth},
     {ProbeSample::kForce, DeviceChannel::kForce},
     {ProbeSample::kX, DeviceChannel::kX},
     {ProbeSample::kY, DeviceChannel::kY}}};

}  // namespace

Expected<std::unique_ptr<Probe>, SetupError> RecordedOutputs::split(
    std::unique_ptr<Probe> recording, const std::vector<std::string>& parts) {
  const ProbeInfo whole = recording->info();
  if (parts.empty()) return recording;
  const auto refuse = [&](const std::string& why) {
    return bad_input("\"" + whole.uri + "\": " + why);
  };
  std::uint32_t bits = 0;
  for (const auto& [bit, channel] : kTraceChannels) {
    if ((whole.channels & bit) != 0U) bits |= bit_of(channel);
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
                     .force = column->force,
                     .pressure = column->pressure});
  }
  for (std::size_t i = 0; i < names.size(); ++i) names[i].column = i + 1;
  for (const std::string& part : parts) {
    const auto wanted = ProbeChannels::parse(part);
    if (!wanted) return refuse(wanted.error());
    Array array;
    if (wanted->taxels) {
      array.columns = whole.taxels > 0 ? std::vector<ChannelName>{}
                                       : taxel_channels(names, wanted->taxels->prefix);
      array.area_mm2 = wanted->taxels->area_mm2;
      const std::size_t count = whole.taxels > 0 ? whole.taxels : array.columns.size();
      if (const std::string why = wrong_taxels(count, *wanted->taxels); !why.empty()) {
        return refuse(why);
      }
      ProbeInfo info = whole;
      info.uri += "#" + part;
      info.channels = ProbeSample::kForce;
      info.extra_columns.clear();
      info.taxels = count;
      outputs->infos_.push_back(std::move(info));
      outputs->calibrations_.emplace_back();
      outputs->arrays_.push_back(std::move(array));
      continue;
    }
    auto chosen = wanted->among(names);
    if (!chosen) return refuse(chosen.error());
    outputs->arrays_.push_back(std::move(array));
    ProbeInfo info = whole;
    info.uri += "#" + part;
    info.name += ", " + names_of_channels(*chosen);
    info.channels = chosen->sample_channels();
    info.extra_columns.clear();
    outputs->infos_.push_back(std::move(info));
    outputs->calibrations_.push_back(std::move(*chosen));
  }
  return outputs;
}

Expected<std::size_t, ProbeError> RecordedOutputs::read(std::span<ProbeSample> samples,
                                                        std::chrono::milliseconds patience) {
  // The samples of an instant are returned together: nobody sees one probe without the others.
  const std::size_t most = samples.size() / infos_.size();
  if (most == 0) return std::size_t{0};
  waiting_.resize(std::min(most, kAtOnce));
  const auto read = ForwardingProbe::read(waiting_, patience);
  if (!read) return read;
  std::size_t count = 0;
  rows_.clear();
  DeviceReading reading;
  for (const ProbeSample& from : std::span(waiting_).first(*read)) {
    reading.set(DeviceChannel::kDepth, from.depth_mm);
    reading.set(DeviceChannel::kForce, units::N_from_mN(from.force_mN));
    reading.set(DeviceChannel::kX, from.x_mm);
    reading.set(DeviceChannel::kY, from.y_mm);
    for (std::size_t i = 0; i < factors_.size(); ++i) {
      reading.set(named_channel(i), from.extra[i] * factors_[i]);
    }
    for (std::size_t i = 0; i < infos_.size(); ++i) {
      ProbeSample sample =
          infos_[i].taxels > 0 ? array_sample(i, reading, from) : calibrations_[i].apply(reading);
      if (!plausible(sample)) sample = {.channels = infos_[i].channels, .row = sample.row};
      sample.time = from.time;
      sample.arrival = from.arrival;
      sample.sequence = from.sequence;
      sample.valid_for = from.valid_for;
      sample.output = static_cast<std::uint32_t>(i);
      samples[count++] = sample;
    }
  }
  return count;
}

/// The sample of an array. Pressures that are missing, or no pressures, are 0.
ProbeSample RecordedOutputs::array_sample(std::size_t output, const DeviceReading& reading,
                                          const ProbeSample& from) {
  const Array& array = arrays_[output];
  ProbeSample sample{.force_mN = from.force_mN, .channels = ProbeSample::kForce, .row = from.row};
  if (array.columns.empty()) {
    if (from.has(ProbeSample::kForce)) return sample;
    for (const float kPa : ForwardingProbe::taxels(from)) {
      sample.force_mN += static_cast<double>(kPa) * array.area_mm2;
    }
    return sample;
  }
  sample.row = static_cast<std::uint32_t>(rows_.size());
  std::vector<float>& row = rows_.emplace_back();
  sample.force_mN = 0.0;
  for (const ChannelName& column : array.columns) {
    const double value = reading[column.channel];
    const double kPa = column.force ? units::mN_from_N(value) / array.area_mm2 : value;
    row.push_back(kPa > 0.0 && kPa <= SampleLimits::kPressure_kPa ? static_cast<float>(kPa) : 0.0F);
    sample.force_mN += static_cast<double>(row.back()) * array.area_mm2;
  }
  return sample;
}

std::span<const float> RecordedOutputs::taxels(const ProbeSample& sample) const {
  if (infos_[sample.output].taxels == 0) return {};
  if (arrays_[sample.output].columns.empty()) return ForwardingProbe::taxels(sample);
  return sample.row < rows_.size() ? rows_[sample.row] : std::span<const float>{};
}

}  // namespace merkel
