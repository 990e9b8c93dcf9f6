#include "drivers/sinks/view/view_frames.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <nlohmann/json.hpp>

#include "core/units.hpp"
#include "drivers/files/raw_bytes.hpp"
#include "drivers/sinks/json_line.hpp"
#include "drivers/sinks/session_position.hpp"

namespace merkel {
namespace {

using std::chrono::nanoseconds;

constexpr nanoseconds kPointEvery{4'000'000};
constexpr std::size_t kMaxPoints = 2000;
constexpr std::size_t kMaxSpikes = 20'000;
constexpr std::size_t kMaxWatchedSamples = 40'000;
constexpr std::size_t kMaxNews = 16'384;
constexpr std::size_t kMaxStates = 16;  ///< probes that fit into the states of a point
constexpr double kBinsPerDecade = 8.0;

void append_float(std::string& bytes, double value) {
  append_raw(bytes, static_cast<float>(value));
}

void append_count(std::string& bytes, std::size_t count) {
  append_raw(bytes, static_cast<std::uint32_t>(count));
}

std::size_t latency_bin(nanoseconds latency) {
  const double us = static_cast<double>(latency.count()) * 1e-3;
  if (us <= 1.0) return 0;
  return std::min(static_cast<std::size_t>(std::log10(us) * kBinsPerDecade),
                  ViewFrames::kLatencyBins - 1);
}

}  // namespace

ViewFrames::ViewFrames(const SinkSetup& setup)
    : tick_(setup.run.model.tick), electrodes_(setup.run.encoding.electrodes.size()) {
  if (setup.session) start_ = setup.session->start;
  for (const Indenter& indenter : setup.run.model.indenters) {
    Probe& probe = probes_.emplace_back();
    probe.taxels.resize(indenter.taxels() != nullptr ? indenter.taxels()->size() : 0);
    if (!setup.session) continue;
    const SkinParameters& skin = setup.run.model.skin;
    if (indenter.surface.slides) {
      probe.surface = std::make_unique<SlidingContact>(indenter, skin, tick_, 0.0);
    } else {
      probe.tip.emplace(indenter, skin);
    }
  }
}

double ViewFrames::since_start_s(nanoseconds time) const {
  return origin_ ? units::s_from(time - *origin_) : 0.0;
}

void ViewFrames::add(const RecordBatch& batch) {
  for (const SpikeEvent& spike : batch.spikes) add(spike);
  for (const SentCommand& sent : batch.sent) add(sent.command);
  for (const TaxelBlock& block : batch.taxels) add(block);
  for (const TickRecord& tick : batch.ticks) add(tick);
  for (const LoopEvent& event : batch.events) add(event);
  for (const NeuronSample& sample : batch.neurons) add(sample);
  for (const Mark& mark : batch.marks) add(mark);
  for (const SyncEdge& edge : batch.edges) add(edge);
  if (!batch.status.empty()) status_ = batch.status.back();
}

void ViewFrames::add(const SpikeEvent& spike) {
  if (spikes_.size() == kMaxSpikes) {
    ++skipped_;
    return;
  }
  spikes_.push_back({.time = spike.time, .neuron = spike.neuron});
}

void ViewFrames::add(const TickRecord& tick) {
  if (tick.probe >= probes_.size()) return;
  if (!origin_) origin_ = sent_ = next_point_ = start_.value_or(tick.time - tick_);
  if (std::exchange(jumped_, false)) sent_ = next_point_ = tick.time - tick_;
  Probe& probe = probes_[tick.probe];
  probe.press = tick.press;
  if (probe.tip) probe.press = probe.tip->press(tick.contact);
  if (probe.surface) {
    probe.surface->take(tick.contact);
    probe.surface->work();
    probe.press = probe.surface->press();
  }
  probe.input = tick.contact;
  probe.state = tick.state;
  probe.touches = touches(tick);
  probe.zero_uncertain = (tick.doubts & ProbeSample::kZeroUncertain) != 0U;
  probe.worst = std::max(probe.worst, tick.state);
  newest_ = tick.time;
  if (tick.probe + 1 != probes_.size()) return;
  // The backlog of the start has no latency.
  if (tick.latency.count() > 0) ++latency_[latency_bin(tick.delay + tick.latency)];
  if (tick.time >= next_point_) add_point(tick.time);
}

void ViewFrames::add(const TaxelBlock& block) {
  if (block.probe >= probes_.size()) return;
  std::vector<float>& taxels = probes_[block.probe].taxels;
  if (block.first + std::size_t{block.count} > taxels.size()) return;
  std::copy_n(block.pressure_kPa.begin(), block.count, taxels.begin() + block.first);
}

void ViewFrames::add_point(nanoseconds time) {
  next_point_ = time + kPointEvery;
  if (points_.size() == kMaxPoints) {
    ++skipped_;
    return;
  }
  Point point{.time = time, .states = 0};
  for (std::size_t i = 0; i < probes_.size(); ++i) {
    Probe& probe = probes_[i];
    if (i < kMaxStates) point.states |= static_cast<std::uint32_t>(probe.worst) << (2 * i);
    probe.worst = probe.state;
    const auto highest = std::max_element(probe.taxels.begin(), probe.taxels.end());
    point_values_.push_back(highest != probe.taxels.end()
                                ? *highest
                                : static_cast<float>(probe.press.contact.depth_mm));
    point_values_.push_back(static_cast<float>(probe.press.contact.force_mN));
  }
  points_.push_back(point);
}

void ViewFrames::add(const LoopEvent& event) {
  if (!origin_) return;
  add_news({{"kind", name_of(event.kind)},
            {"t", since_start_s(event.time)},
            {"length_s", units::s_from(event.length)},
            {"subject", event.subject}});
}

void ViewFrames::add(const Mark& mark) {
  if (!origin_) return;
  add_news({{"kind", "mark"}, {"t", since_start_s(mark.time)}, {"label", mark.label}});
}

/// A pulse, by its begin.
void ViewFrames::add(const SyncEdge& edge) {
  if (!origin_ || edge.level == 0) return;
  add_news({{"kind", "sync"}, {"t", since_start_s(edge.time)}, {"line", edge.line}});
}

void ViewFrames::add(const NeuronSample& sample) {
  if (watched_.size() < kMaxWatchedSamples) {
    watched_.push_back(sample);
  } else {
    ++skipped_;
  }
}

void ViewFrames::add(const StimulationCommand& command) {
  if (command.electrode >= electrodes_.size()) return;
  Stimulation& electrode = electrodes_[command.electrode];
  if (command.kind == StimulationCommand::Kind::kPulse) {
    ++electrode.pulses;
    electrode.amplitude_uA = command.amplitude_uA;
    return;
  }
  // An electrode that gives pulses gets updates with amplitude 0 between them.
  const bool stopped = command.stop != StimulationCommand::Stop::kNone;
  if (stopped || electrode.pulses == 0) electrode.amplitude_uA = command.amplitude_uA;
  electrode.frequency_Hz = command.frequency_Hz;
  electrode.stop = command.stop;
}

void ViewFrames::set_links(const RunControl& control) {
  for (std::size_t i = 0; i < probes_.size(); ++i) probes_[i].link = control.link(i);
}

void ViewFrames::forget() {
  points_.clear();
  point_values_.clear();
  spikes_.clear();
  watched_.clear();
  news_.clear();
  for (Probe& probe : probes_) std::fill(probe.taxels.begin(), probe.taxels.end(), 0.0F);
  jumped_ = true;
}

void ViewFrames::add_notice(std::string_view sentence) {
  add_news({{"kind", "notice"}, {"label", sentence}});
}

void ViewFrames::add_news(const nlohmann::json& event) {
  const std::string json = json_line(event);
  if (news_.size() + json.size() > kMaxNews) {
    ++skipped_;
    return;
  }
  news_ += (news_.empty() ? "" : ",") + json;
}

std::string ViewFrames::take(std::uint32_t flags) {
  std::string bytes;
  bytes.reserve(512 + 8 * spikes_.size() + 4 * point_values_.size() + 8 * points_.size());
  append_raw(bytes, ++number_);
  append_raw(bytes, flags);
  append_raw(bytes, origin_ ? units::s_from(*origin_) : 0.0);
  append_raw(bytes, since_start_s(sent_));
  append_raw(bytes, since_start_s(newest_));
  append_counters(bytes);
  append_probes(bytes);
  append_points(bytes);
  append_spikes(bytes);
  append_count(bytes, latency_.size());
  for (const std::uint32_t ticks : latency_) append_raw(bytes, ticks);
  append_watched(bytes);
  append_electrodes(bytes);
  const std::string news = news_.empty() ? "" : "[" + news_ + "]";
  append_count(bytes, news.size());
  bytes += news;
  points_.clear();
  point_values_.clear();
  if (is_timed()) {
    spikes_.clear();
    watched_.clear();
  }
  news_.clear();
  for (Stimulation& electrode : electrodes_) electrode.pulses = 0;
  sent_ = newest_;
  return bytes;
}

void ViewFrames::append_counters(std::string& bytes) const {
  append_count(bytes, kRunCounterFields<>.size() + 1);
  for (const auto& field : kRunCounterFields<>) {
    append_raw(bytes, static_cast<double>(status_.counters.*field.cell));
  }
  append_raw(bytes, static_cast<double>(status_.losses.spikes + status_.losses.ticks + skipped_));
}

void ViewFrames::append_probes(std::string& bytes) const {
  append_count(bytes, probes_.size());
  for (const Probe& probe : probes_) {
    append_float(bytes, probe.press.contact.depth_mm);
    append_float(bytes, probe.press.contact.force_mN);
    append_float(bytes, probe.press.x_mm);
    append_float(bytes, probe.press.y_mm);
    append_float(bytes, probe.press.contact.contact_radius_mm);
    append_float(bytes, probe.input.depth_mm);
    append_float(bytes, probe.input.x_mm);
    append_float(bytes, probe.input.y_mm);
    append_raw(bytes, static_cast<std::uint32_t>(probe.state) | (probe.zero_uncertain ? 64U : 0U) |
                          (probe.touches ? 128U : 0U) |
                          static_cast<std::uint32_t>(probe.link) << 8U);
    append_count(bytes, probe.taxels.size());
    for (const float pressure : probe.taxels) append_raw(bytes, pressure);
  }
}

void ViewFrames::append_points(std::string& bytes) const {
  append_count(bytes, points_.size());
  const std::size_t values = 2 * probes_.size();
  for (std::size_t i = 0; i < points_.size(); ++i) {
    append_float(bytes, units::s_from(newest_ - points_[i].time));
    append_raw(bytes, points_[i].states);
    for (std::size_t k = 0; k < values; ++k) append_raw(bytes, point_values_[i * values + k]);
  }
}

void ViewFrames::append_spikes(std::string& bytes) const {
  if (!is_timed()) return append_count(bytes, 0);
  append_count(bytes, spikes_.size());
  for (const Spike& spike : spikes_) {
    append_float(bytes, units::s_from(newest_ - spike.time));
    append_raw(bytes, spike.neuron);
  }
}

/// Neuron by neuron, in order of first appearance.
void ViewFrames::append_watched(std::string& bytes) const {
  if (!is_timed()) return append_count(bytes, 0);
  std::vector<std::uint32_t> numbers;
  for (const NeuronSample& sample : watched_) {
    if (std::find(numbers.begin(), numbers.end(), sample.neuron) == numbers.end()) {
      numbers.push_back(sample.neuron);
    }
  }
  append_count(bytes, numbers.size());
  for (const std::uint32_t number : numbers) {
    const auto of_neuron = [number](const NeuronSample& sample) { return sample.neuron == number; };
    append_raw(bytes, number);
    append_count(bytes, static_cast<std::size_t>(
                            std::count_if(watched_.begin(), watched_.end(), of_neuron)));
    for (const NeuronSample& sample : watched_) {
      if (!of_neuron(sample)) continue;
      append_float(bytes, units::s_from(newest_ - sample.time));
      append_raw(bytes, sample.drive);
      append_raw(bytes, sample.potential);
    }
  }
}

void ViewFrames::append_electrodes(std::string& bytes) const {
  append_count(bytes, electrodes_.size());
  for (const Stimulation& electrode : electrodes_) {
    append_float(bytes, electrode.amplitude_uA);
    append_float(bytes, electrode.frequency_Hz);
    append_raw(bytes, static_cast<std::uint32_t>(electrode.stop));
    append_raw(bytes, electrode.pulses);
  }
}

}  // namespace merkel
