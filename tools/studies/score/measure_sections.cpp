// Sections with other measurements of an afferent, and recorded presses with their spikes.
#include <charconv>
#include <cmath>
#include <limits>
#include <utility>

#include "core/units.hpp"
#include "tools/studies/score/recording_sections.hpp"

namespace merkel {
namespace {

void read_tip(JsonFields& fields, Indenter& indenter) {
  const std::string tip = fields.text("tip");
  if (tip.empty() || tip == "sphere") {
    if (const Json* const radius = fields.find("radius_mm"); radius != nullptr) {
      indenter.tip =
          SphereTip{radius->is_string() && radius->get<std::string>() == "inf"
                        ? std::numeric_limits<double>::infinity()
                        : JsonFields::number_of(*radius, fields.full("radius_mm"), false)};
    }
  } else if (tip == "pin") {
    indenter.tip = PinTip{.diameter_mm = fields.number("probe_diameter_mm", 1.0)};
  } else if (tip == "bars") {
    static_cast<void>(read_bars(fields, indenter));
  } else {
    refuse_field(fields.full("tip"), "must be \"sphere\", \"pin\" or \"bars\"");
  }
}

/// An array of pins at a background depth.
PinArray read_array(JsonFields& fields, double background_mm) {
  PinArray array;
  array.diameter_mm = fields.number("probe_diameter_mm", array.diameter_mm);
  array.spacing_mm = fields.number("spacing_mm", array.spacing_mm);
  if (array.spacing_mm < array.diameter_mm) {
    refuse_field(fields.full("spacing_mm"),
                 "must be at least probe_diameter_mm: pins do not overlap");
  }
  const double pins = fields.number("pins", static_cast<double>(array.pins));
  if (pins != std::floor(pins) || pins < 1.0 || pins > static_cast<double>(PinArray::kMaxPins)) {
    refuse_field(fields.full("pins"),
                 "must be a whole number from 1 to " + std::to_string(PinArray::kMaxPins));
  }
  array.pins = static_cast<std::size_t>(pins);
  array.background_mm = background_mm;
  return array;
}

}  // namespace

void read_field_area(JsonFields fields, Recordings& recordings) {
  const std::vector<double> depth_um = fields.numbers("depth_um");
  const auto area =
      series(fields.need("SA1_mm2"), fields.full("SA1_mm2"), depth_um.size(), "depth_um");
  const double background_mm = fields.number("background_depth_mm", 0.0, true);
  Recordings::FieldAreas areas{.array = read_array(fields, background_mm)};
  if (background_mm == 0.0) areas.array.pins = 1;
  for (std::size_t i = 0; i < area.size(); ++i) {
    areas.points.push_back({.depth_mm = units::mm_from_um(depth_um[i]), .area_mm2 = area[i]});
  }
  recordings.field_areas.push_back(std::move(areas));
  if (const std::string text = fields.text("trial_sd"); !text.empty()) {
    double bound = 0.0;
    const char* const first = text.c_str() + 2;
    if (text.size() < 3 || text.compare(0, 2, "< ") != 0 ||
        std::from_chars(first, text.data() + text.size(), bound).ec != std::errc() ||
        text.find("impulse") == std::string::npos) {
      refuse_field(fields.full("trial_sd"), "must be a bound with its unit, as in \"< 1 impulse\"");
    }
    recordings.most_trial_sd = bound;
  }
  fields.finish();
}

void read_surround(JsonFields fields, Recordings& recordings) {
  const std::vector<double> raised = fields.numbers("raised_pins");
  const auto ratio =
      series(fields.need("rate_ratio"), fields.full("rate_ratio"), raised.size(), "raised_pins");
  const double depth_mm = units::mm_from_um(fields.number("depth_um", 100.0));
  const std::vector<double> backgrounds = fields.numbers("background_depth_mm");
  const PinArray array = read_array(fields, 0.0);
  for (const double background_mm : backgrounds) {
    Recordings::Surround surround{.array = array, .depth_mm = depth_mm};
    surround.array.background_mm = background_mm;
    for (std::size_t i = 0; i < ratio.size(); ++i) {
      if (raised[i] != std::floor(raised[i]) || raised[i] < 2.0 ||
          raised[i] > static_cast<double>(array.pins)) {
        refuse_field(fields.full("raised_pins"),
                     "must be whole numbers from 2 to the number of pins");
      }
      surround.points.push_back(
          {.pins = static_cast<std::size_t>(raised[i]), .rate_ratio = ratio[i]});
    }
    recordings.surrounds.push_back(std::move(surround));
  }
  fields.finish();
}

void read_kinetics(JsonFields fields, Recordings& recordings) {
  const Json& taus = fields.need("tau_ms");
  if (!taus.is_array()) refuse_field(fields.full("tau_ms"), "must be a list");
  for (const Json& tau : taus) {
    if (tau.is_string() && tau.get<std::string>() == "inf") continue;
    recordings.time_constants_ms.push_back(
        JsonFields::number_of(tau, fields.full("tau_ms"), false));
  }
  fields.finish();
}

void read_intervals(JsonFields fields, Recordings& recordings) {
  const std::vector<double> depth = fields.numbers("depth_mm");
  const auto mean =
      series(fields.need("mean_isi_ms"), fields.full("mean_isi_ms"), depth.size(), "depth_mm");
  const auto sd = series(fields.need("sd_ms"), fields.full("sd_ms"), depth.size(), "depth_mm");
  for (std::size_t i = 0; i < mean.size(); ++i) {
    recordings.intervals.push_back({.mean_ms = mean[i], .sd_ms = sd[i]});
  }
  fields.finish();
}

void read_trials(JsonFields fields, const std::string& cite, Recordings& recordings) {
  RecordedTrials trials;
  trials.cite = cite;
  trials.trace_file = fields.text("trace");
  if (trials.trace_file.empty()) {
    refuse_field(fields.full("trace"), "is missing: give the file of the recorded press (CSV)");
  }
  trials.name = "trials: " + trials.trace_file;
  if (const std::string name = fields.text("name"); !name.empty()) trials.name = name;
  if (trials.name.find_first_of("\"\n") != std::string::npos) {
    refuse_field(fields.full("name"), "must not contain quotes or line breaks");
  }
  read_tip(fields, trials.stimulus.indenter);
  if (const Json* const place = fields.find("afferent_mm"); place != nullptr) {
    const auto xy = JsonFields::numbers_of(*place, fields.full("afferent_mm"), true);
    if (xy.size() != 2) refuse_field(fields.full("afferent_mm"), "must be two numbers: [x, y]");
    trials.stimulus.afferent_x_mm = xy[0];
    trials.stimulus.afferent_y_mm = xy[1];
  }
  trials.spikes_file = fields.text("spikes");
  const Json* const times = fields.find("spike_times_s");
  if ((times != nullptr) == !trials.spikes_file.empty()) {
    refuse_field(fields.full("spikes"),
                 "or spike_times_s must be given, one of the two: the recorded spikes");
  }
  if (times != nullptr) {
    if (!times->is_array() || times->empty()) {
      refuse_field(fields.full("spike_times_s"),
                   "must be a list with a list of times for each trial");
    }
    for (const Json& train : *times) {
      if (train.is_array() && train.empty()) {
        trials.spikes_s.emplace_back();
        continue;
      }
      trials.spikes_s.push_back(JsonFields::numbers_of(train, fields.full("spike_times_s"), true));
    }
  }
  trials.frequency_hz = fields.number("frequency_hz", 0.0, true);
  trials.stimulus.frequency_hz = trials.frequency_hz;
  trials.cost_per_s = fields.number("victor_purpura_cost_per_s", trials.cost_per_s);
  trials.tau_s = 1e-3 * fields.number("van_rossum_tau_ms", 1e3 * trials.tau_s);
  trials.bin_s = 1e-3 * fields.number("bin_ms", 1e3 * trials.bin_s);
  recordings.trials.push_back(std::move(trials));
  fields.finish();
}

}  // namespace merkel
