#include "drivers/sinks/view/view_frames.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/parameters/parameter_error.hpp"
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

/// A JSON object or list, written from front to back.
class Json {
 public:
  explicit Json(char opening = '{') : text_(1, opening) {}
  Json& item(const std::string& json) {
    if (text_.size() > 1) text_ += ',';
    text_ += json;
    return *this;
  }
  Json& raw(std::string_view name, const std::string& json) {
    return item(json_string(name) + ":" + json);
  }
  Json& text(std::string_view name, std::string_view value) {
    return raw(name, json_string(value));
  }
  Json& number(std::string_view name, double value) { return raw(name, number_of(value)); }
  [[nodiscard]] std::string end() { return text_ + (text_.front() == '{' ? '}' : ']'); }

  /// Infinity, which JSON does not have, is null.
  static std::string number_of(double value) {
    return std::isfinite(value) ? shortest_decimal(value) : "null";
  }

 private:
  std::string text_;
};

/// A patch with its receptors, and the middle of those of each afferent.
std::string json_of(const TactileModel::PatchParameters& parameters,
                    const std::vector<Receptor>& receptors) {
  struct Middle {
    double x_mm = 0.0;
    double y_mm = 0.0;
    double count = 0.0;
  };
  std::vector<Middle> middles;
  Json dots('[');
  // Evenly thinned out where there are more than a picture shows.
  const std::size_t stride = receptors.size() / kMostReceptors + 1;
  for (std::size_t i = 0; i < receptors.size(); ++i) {
    const Receptor& receptor = receptors[i];
    if (middles.size() < receptor.neuron) middles.resize(receptor.neuron);
    Middle& middle = middles[receptor.neuron - 1];
    middle.x_mm += receptor.x_mm;
    middle.y_mm += receptor.y_mm;
    middle.count += 1.0;
    if (i % stride == 0) {
      dots.item(Json('[')
                    .item(Json::number_of(receptor.x_mm))
                    .item(Json::number_of(receptor.y_mm))
                    .end());
    }
  }
  Json centres('[');
  for (const Middle& middle : middles) {
    centres.item(Json('[')
                     .item(Json::number_of(middle.x_mm / middle.count))
                     .item(Json::number_of(middle.y_mm / middle.count))
                     .end());
  }
  const bool fields = parameters.layout == ReceptorLayout::kFields;
  return Json()
      .text("name", parameters.name)
      .number("length_mm", parameters.patch.length_mm)
      .number("width_mm", parameters.patch.width_mm)
      .number("columns", parameters.patch.columns)
      .number("rows", parameters.patch.rows)
      .number("field_radius_mm", fields ? parameters.field.radius_mm : 0.0)
      .raw("receptors", dots.end())
      .raw("centres", centres.end())
      .end();
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
  Json json;
  json.text("scene", run_.scene).number("neurons", numbering_.neurons());
  json.number("tick_ms", units::ms_from(run_.model.tick));
  Json counters('[');
  for (const std::string_view counter : kCounters) counters.item(json_string(counter));
  json.raw("counters", counters.end());
  Json patches('[');
  for (std::size_t i = 0; i < run_.receptors.size(); ++i) {
    patches.item(json_of(run_.model.patches[i], run_.receptors[i]));
  }
  json.raw("patches", patches.end());
  Json probes('[');
  for (const Indenter& indenter : run_.model.indenters) {
    probes.item(Json()
                    .text("tip", indenter.tip == Indenter::Tip::kSphere ? "sphere" : "other")
                    .number("radius_mm", indenter.radius_mm)
                    .number("patch", static_cast<double>(indenter.patch))
                    .end());
  }
  json.raw("probes", probes.end());
  Json facts('[');
  for (const auto& [name, value] : run_.facts) {
    facts.item(Json('[').item(json_string(name)).item(json_string(value)).end());
  }
  return json.raw("facts", facts.end()).end();
}

}  // namespace merkel
