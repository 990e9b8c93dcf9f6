#include "drivers/sinks/view/view_frames.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/parameter_error.hpp"
#include "core/units.hpp"
#include "drivers/sinks/json_text.hpp"

namespace merkel {
namespace {

static_assert(std::endian::native == std::endian::little);

using std::chrono::nanoseconds;

constexpr nanoseconds kPointEvery{4'000'000};
constexpr std::size_t kMostPoints = 2000;
constexpr std::size_t kMostSpikes = 20'000;
constexpr std::size_t kMostReceptors = 5000;
constexpr double kBinsPerDecade = 8.0;
constexpr std::uint32_t kOver = 1;

template <class T>
void append(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

void append_float(std::string& bytes, double value) { append(bytes, static_cast<float>(value)); }

std::size_t latency_bin(nanoseconds latency) {
  const double us = static_cast<double>(latency.count()) * 1e-3;
  if (us <= 1.0) return 0;
  return std::min(static_cast<std::size_t>(std::log10(us) * kBinsPerDecade),
                  ViewFrames::kLatencyBins - 1);
}

std::string pair_of(std::string_view name, const std::string& json) {
  return json_string(name) + ":" + json;
}

std::string number_of(double value) {
  return std::isfinite(value) ? shortest_decimal(value) : "null";
}

}  // namespace

ViewFrames::ViewFrames(const SinkSetup& setup) : numbering_(setup.numbering), run_(setup.run) {
  for (const Indenter& indenter : run_.model.indenters) {
    probes_.push_back({.tip = TipContact(indenter, run_.model.skin), .press = {}, .state = {}});
  }
}

void ViewFrames::add(std::span<const SpikeEvent> spikes) {
  all_spikes_ += spikes.size();
  for (const SpikeEvent& spike : spikes) {
    if (spikes_.size() == kMostSpikes) {
      ++left_out_;
      continue;
    }
    spikes_.push_back({.time = spike.time, .neuron = numbering_.number(spike)});
  }
}

void ViewFrames::add(std::span<const TickRecord> ticks) {
  for (const TickRecord& tick : ticks) {
    if (tick.probe >= probes_.size()) continue;
    if (!origin_) origin_ = next_point_ = tick.time - run_.model.tick;
    Probe& probe = probes_[tick.probe];
    probe.press = probe.tip.press(tick.contact);
    probe.state = tick.state;
    newest_ = tick.time;
    late_ += tick.late;
    if (tick.state == TickRecord::State::kHeld) ++held_ticks_;
    if (tick.state == TickRecord::State::kReleased) ++released_ticks_;
    if (tick.probe + 1 != probes_.size()) continue;
    ++latency_[latency_bin(tick.latency)];
    if (tick.time < next_point_) continue;
    next_point_ = tick.time + kPointEvery;
    if (point_times_.size() == kMostPoints) {
      ++left_out_;
      continue;
    }
    point_times_.push_back(tick.time);
    for (const Probe& each : probes_) {
      point_values_.push_back(static_cast<float>(each.press.contact.depth_mm));
      point_values_.push_back(static_cast<float>(each.press.contact.force_mN));
    }
  }
}

std::string ViewFrames::take(bool over) {
  const auto before_newest = [this](nanoseconds time) { return units::s_from(newest_ - time); };
  const std::array<double, kCounters.size()> counters = {
      static_cast<double>(all_spikes_),
      static_cast<double>(status_.ticks),
      static_cast<double>(status_.overruns),
      static_cast<double>(status_.longest_overrun_ns) * 1e-6,
      static_cast<double>(status_.catch_up_ticks),
      static_cast<double>(status_.gaps),
      static_cast<double>(status_.skipped_ticks),
      static_cast<double>(status_.neuron_resets),
      static_cast<double>(status_.samples),
      static_cast<double>(late_),
      static_cast<double>(status_.samples_dropped),
      static_cast<double>(held_ticks_),
      static_cast<double>(released_ticks_),
      static_cast<double>(status_.spikes_dropped),
      static_cast<double>(status_.losses.spikes + status_.losses.ticks + left_out_),
      static_cast<double>(status_.probes),
      static_cast<double>(status_.probes_ended)};
  std::string bytes;
  append(bytes, ++number_);
  append(bytes, over ? kOver : std::uint32_t{0});
  append(bytes, origin_ ? units::s_from(newest_ - *origin_) : 0.0);
  append(bytes, static_cast<std::uint32_t>(counters.size()));
  for (const double counter : counters) append(bytes, counter);
  append(bytes, static_cast<std::uint32_t>(probes_.size()));
  for (const Probe& probe : probes_) {
    append_float(bytes, probe.press.contact.depth_mm);
    append_float(bytes, probe.press.contact.force_mN);
    append_float(bytes, probe.press.x_mm);
    append_float(bytes, probe.press.y_mm);
    append_float(bytes, probe.press.contact.contact_radius_mm);
    append(bytes, static_cast<std::uint32_t>(probe.state));
  }
  append(bytes, static_cast<std::uint32_t>(point_times_.size()));
  for (std::size_t i = 0; i < point_times_.size(); ++i) {
    append_float(bytes, before_newest(point_times_[i]));
    for (std::size_t value = 0; value < 2 * probes_.size(); ++value) {
      append(bytes, point_values_[i * 2 * probes_.size() + value]);
    }
  }
  append(bytes, static_cast<std::uint32_t>(spikes_.size()));
  for (const Spike& spike : spikes_) {
    append_float(bytes, before_newest(spike.time));
    append(bytes, spike.neuron);
  }
  append(bytes, static_cast<std::uint32_t>(latency_.size()));
  for (const std::uint32_t ticks : latency_) append(bytes, ticks);
  point_times_.clear();
  point_values_.clear();
  spikes_.clear();
  return bytes;
}

std::string ViewFrames::hello() const {
  const Patch& patch = run_.model.patches.front().patch;
  std::string json = "{" + pair_of("scene", json_string(run_.scene));
  json += "," + pair_of("neurons", std::to_string(numbering_.neurons()));
  json += "," + pair_of("tick_ms", number_of(units::ms_from(run_.model.tick)));
  json += "," + pair_of("patch", "{" + pair_of("length_mm", number_of(patch.length_mm)) + "," +
                                     pair_of("width_mm", number_of(patch.width_mm)) + "," +
                                     pair_of("columns", std::to_string(patch.columns)) + "," +
                                     pair_of("rows", std::to_string(patch.rows)) + "}");
  std::string list;
  for (const std::string_view counter : kCounters) {
    list += (list.empty() ? "" : ",") + json_string(counter);
  }
  json += "," + pair_of("counters", "[" + list + "]");
  list.clear();
  // Evenly thinned out where there are more than a picture shows.
  const std::size_t stride = run_.receptors.size() / kMostReceptors + 1;
  for (std::size_t i = 0; i < run_.receptors.size(); i += stride) {
    const Receptor& receptor = run_.receptors[i];
    list += (list.empty() ? "[" : ",[") + number_of(receptor.x_mm) + "," +
            number_of(receptor.y_mm) + "," + std::to_string(receptor.neuron) + "]";
  }
  json += "," + pair_of("receptors", "[" + list + "]");
  list.clear();
  for (const Indenter& indenter : run_.model.indenters) {
    const bool sphere = indenter.tip == Indenter::Tip::kSphere;
    list += (list.empty() ? "{" : ",{") + pair_of("tip", sphere ? "\"sphere\"" : "\"bars\"") + "," +
            pair_of("radius_mm", number_of(indenter.radius_mm)) + "," +
            pair_of("length_mm", number_of(indenter.bars.length_mm)) + "}";
  }
  json += "," + pair_of("probes", "[" + list + "]");
  list.clear();
  for (const auto& [name, value] : run_.facts) {
    list += (list.empty() ? "[" : ",[") + json_string(name) + "," + json_string(value) + "]";
  }
  return json + "," + pair_of("facts", "[" + list + "]") + "}";
}

}  // namespace merkel
