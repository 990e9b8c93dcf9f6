#include "tools/studies/encoders/encoder_comparison.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <variant>

#include "core/parameters/nearest_name.hpp"
#include "core/units.hpp"
#include "realtime/output/spike_callback.hpp"
#include "realtime/pipeline.hpp"
#include "tools/scene/prepared_run.hpp"

namespace merkel {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

Choice encoder_choice(Electrode& electrode, std::vector<std::string>& words) {
  BoundFields fields;
  bind_fields(Electrode::source_fields(), &electrode, fields);
  for (const BoundField& key : fields) {
    if (key.field->key != "encoder") continue;
    words = key.words;
    return std::get<Choice>(key.value);
  }
  return {};
}

Expected<void, SetupError> set_encoder(Scene& scene, const std::string& name) {
  std::vector<std::string> words;
  Electrode any;
  static_cast<void>(encoder_choice(any, words));
  const auto found = std::find(words.begin(), words.end(), name);
  if (found == words.end()) {
    return bad_input("--encoder " + name + ": there is no such encoder; use one of " +
                     listed(words));
  }
  const auto set = [&](Electrode& electrode) {
    const Choice choice = encoder_choice(electrode, words);
    choice.set(choice.value, static_cast<std::size_t>(found - words.begin()));
  };
  for (ElectrodeGroup& group : scene.encoding.groups) set(group.pattern);
  for (Electrode& electrode : scene.encoding.electrodes) set(electrode);
  if (const auto checked = scene.encoding.check(); !checked) {
    return bad_input(scene.sentence(checked.error()));
  }
  return {};
}

double mean_of(const std::vector<double>& values, std::size_t begin, std::size_t end) {
  double sum = 0.0;
  for (std::size_t i = begin; i < end; ++i) sum += values[i];
  return sum / static_cast<double>(end - begin);
}

/// Pearson's; NaN if one is constant.
double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const double mean_a = mean_of(a, 0, a.size());
  const double mean_b = mean_of(b, 0, b.size());
  double ab = 0.0;
  double aa = 0.0;
  double bb = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ab += (a[i] - mean_a) * (b[i] - mean_b);
    aa += (a[i] - mean_a) * (a[i] - mean_a);
    bb += (b[i] - mean_b) * (b[i] - mean_b);
  }
  return ab / std::sqrt(aa * bb);
}

std::size_t bin_of(const EncodedTouch& touch, nanoseconds time, nanoseconds bin) {
  const nanoseconds start = touch.ticks.front().time - touch.tick;
  return static_cast<std::size_t>(std::max(nanoseconds{0}, time - start) / bin);
}

double onset_ratio(const EncodedTouch& touch) {
  constexpr milliseconds kBin{1};
  const std::vector<double> rate = charge_rate(touch, kBin);
  std::vector<bool> touched(rate.size());
  for (const TickRecord& tick : touch.ticks) {
    const std::size_t bin = std::min(bin_of(touch, tick.time, kBin), rate.size() - 1);
    if (touches(tick)) touched[bin] = true;
  }
  double sum = 0.0;
  int touches = 0;
  for (std::size_t begin = 0; begin < rate.size(); ++begin) {
    if (!touched[begin]) continue;
    std::size_t end = begin;
    while (end < rate.size() && touched[end]) ++end;
    if (end - begin >= 400) {
      const double held = mean_of(rate, begin + 200, end);
      if (held > 0.0) {
        sum += mean_of(rate, begin, begin + 100) / held;
        ++touches;
      }
    }
    begin = end;
  }
  return touches > 0 ? sum / touches : std::numeric_limits<double>::quiet_NaN();
}

double peak_total_uA(const EncodedTouch& touch) {
  std::vector<double> trains_uA(touch.electrodes.size());
  std::vector<double> pulses_uA(touch.electrodes.size());
  nanoseconds tick{std::numeric_limits<std::int64_t>::min()};
  double largest = 0.0;
  for (const StimulationCommand& command : touch.commands) {
    if (command.time > tick) {  // the pulses of the tick before are over
      std::fill(pulses_uA.begin(), pulses_uA.end(), 0.0);
      const auto ticks = (command.time + touch.tick - nanoseconds{1}) / touch.tick;
      tick = ticks * touch.tick;
    }
    const bool pulse = command.kind == StimulationCommand::Kind::kPulse;
    double& level_uA = (pulse ? pulses_uA : trains_uA)[command.electrode];
    level_uA = pulse ? std::max(level_uA, command.amplitude_uA) : command.amplitude_uA;
    // The commands of an update come together: the last one completes it.
    if (!pulse && command.electrode + std::size_t{1} < touch.electrodes.size()) continue;
    double total_uA = 0.0;
    for (std::size_t e = 0; e < trains_uA.size(); ++e) total_uA += trains_uA[e] + pulses_uA[e];
    largest = std::max(largest, total_uA);
  }
  return largest;
}

}  // namespace

std::vector<std::string> encoder_names() {
  std::vector<std::string> words;
  Electrode any;
  static_cast<void>(encoder_choice(any, words));
  return words;
}

Expected<EncodedTouch, SetupError> encode_touch(Scene scene, const std::string& encoder) {
  if (const auto set = set_encoder(scene, encoder); !set)
    return Unexpected<SetupError>(set.error());
  auto prepared = prepare_run(std::move(scene), {.fast = true});
  if (!prepared) return Unexpected<SetupError>(prepared.error());
  EncodedTouch touch{.encoder = encoder};
  const EncodingParameters& encoding = prepared->encoder->parameters();
  touch.electrodes = encoding.electrodes;
  touch.tick = prepared->model->parameters().tick;
  for (const Electrode& each : encoding.electrodes) {
    touch.phases.push_back(ElectrodeLimits::of(each, encoding.stimulation).phase);
  }
  Pipeline pipeline(*prepared->model, prepared->parameters);
  prepared->add_probes_to(pipeline);
  const auto append = [](auto& to, const auto& from) {
    to.insert(to.end(), from.begin(), from.end());
  };
  pipeline.add_sink(std::make_unique<RecordCallback>(
      "memory", kKinds<SpikeEvent, StimulationCommand, TickRecord>, [&](const RecordBatch& batch) {
        append(touch.spikes, batch.spikes);
        append(touch.commands, batch.commands);
        append(touch.ticks, batch.ticks);
      }));
  const auto report = pipeline.run();
  if (!report) return Unexpected<SetupError>(report.error());
  if (!report->error_message.empty()) return bad_input(report->error_message);
  if (touch.ticks.empty()) return bad_input("the recording has no samples to encode");
  return touch;
}

std::vector<double> charge_rate(const EncodedTouch& touch, nanoseconds bin) {
  const nanoseconds start = touch.ticks.front().time - touch.tick;
  const nanoseconds end = touch.ticks.back().time;
  std::vector<double> charge_nC(
      static_cast<std::size_t>((end - start + bin - nanoseconds{1}) / bin));
  std::vector<std::optional<StimulationCommand>> trains(touch.electrodes.size());
  const auto add_train = [&](const StimulationCommand& train, nanoseconds until) {
    const double charge_nC_per_s =
        merkel::charge_nC(train.amplitude_uA, touch.phases[train.electrode]) * train.frequency_Hz;
    for (nanoseconds from = train.time; charge_nC_per_s > 0.0 && from < until;) {
      const std::size_t k = bin_of(touch, from, bin);
      const nanoseconds to = std::min(until, start + static_cast<std::int64_t>(k + 1) * bin);
      if (k < charge_nC.size()) charge_nC[k] += charge_nC_per_s * units::s_from(to - from);
      from = to;
    }
  };
  for (const StimulationCommand& command : touch.commands) {
    if (command.kind == StimulationCommand::Kind::kPulse) {
      const std::size_t k = std::min(bin_of(touch, command.time, bin), charge_nC.size() - 1);
      charge_nC[k] += merkel::charge_nC(command.amplitude_uA, touch.phases[command.electrode]);
      continue;
    }
    auto& train = trains[command.electrode];
    if (train) add_train(*train, command.time);
    train = command;
  }
  for (double& each : charge_nC) each *= 1e-3 / units::s_from(bin);
  return charge_nC;
}

EncoderFigures figures_of(const EncodedTouch& touch) {
  constexpr milliseconds kBin{50};
  EncoderFigures figures{.encoder = touch.encoder};
  const std::vector<double> rate = charge_rate(touch, kBin);
  for (const double each : rate) figures.charge_uC += each * units::s_from(kBin);
  for (const StimulationCommand& command : touch.commands) {
    figures.peak_uA = std::max(figures.peak_uA, command.amplitude_uA);
  }
  figures.peak_total_uA = peak_total_uA(touch);
  figures.onset_ratio = onset_ratio(touch);
  std::vector<double> spikes(rate.size());
  for (const SpikeEvent& spike : touch.spikes) {
    spikes[std::min(bin_of(touch, spike.time, kBin), spikes.size() - 1)] += 1.0;
  }
  figures.rate_correlation = correlation(rate, spikes);
  return figures;
}

}  // namespace merkel
