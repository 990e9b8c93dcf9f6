#include "tools/studies/score/recordings.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <utility>

#include "core/parameters/nearest_name.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/units.hpp"
#include "tools/studies/score/json_fields.hpp"
#include "tools/studies/score/recorded_trials.hpp"

namespace merkel {

/// The text of tools/studies/score/physiology.json, built into the program.
extern const char* const kPublishedRecordings;

namespace {

using Json = JsonFields::Json;

/// What all sections may say of how the tip was pressed.
void read_timing(JsonFields& fields, Stimulus& stimulus) {
  stimulus.ramp_s = 1e-3 * fields.number("ramp_ms", 1e3 * stimulus.ramp_s);
  stimulus.count_s = fields.number("count_s", stimulus.count_s);
}

/// A number for each x; for the name of a series ("10gwt_0.098N").
std::vector<double> series(const Json& values, const std::string& field, std::size_t count,
                           const std::string& x_name) {
  std::vector<double> numbers = JsonFields::numbers_of(values, field);
  if (numbers.size() != count) {
    refuse_field(field, "must have as many numbers as " + x_name + ": " + std::to_string(count) +
                            ", but has " + std::to_string(numbers.size()));
  }
  return numbers;
}

/// The level of a hold from the name of a series, in N or mm.
void set_level(Stimulus& stimulus, const std::string& key, const std::string& field) {
  if (ends_in(key, "mm")) {
    stimulus.indenter.control = Indenter::Control::kDepth;
    stimulus.level = quantity(key, "mm", field, "0.65mm");
  } else {
    stimulus.indenter.control = Indenter::Control::kForce;
    stimulus.level = units::mN_from_N(quantity(key, "N", field, "20gwt_0.196N"));
  }
}

std::string level_name(const Stimulus& stimulus) {
  return stimulus.indenter.control == Indenter::Control::kForce
             ? shortest_decimal(units::N_from_mN(stimulus.level)) + " N"
             : shortest_decimal(stimulus.level) + " mm";
}

double radius_of_curvature_mm(double curvature_per_m) {
  return curvature_per_m > 0.0 ? 1e3 / curvature_per_m : std::numeric_limits<double>::infinity();
}

const Json& series_of(JsonFields& fields, const std::string& key) {
  const Json& rates = fields.need(key);
  if (!rates.is_object() || rates.empty()) {
    refuse_field(fields.full(key), "must be an object with a list of numbers for each series");
  }
  return rates;
}

void read_curvature_force(JsonFields fields, const std::string& cite, Recordings& recordings) {
  const std::vector<double> curvature = fields.numbers("curvature_per_m");
  Stimulus base;
  read_timing(fields, base);
  for (const auto& [key, values] : series_of(fields, "rate_hz").items()) {
    const std::string field = fields.full("rate_hz." + key);
    Stimulus stimulus = base;
    set_level(stimulus, key, field);
    DataSet set{.name = "curvature × force, " + level_name(stimulus),
                .section = "curvature_force",
                .x_name = "curvature_per_m",
                .y_name = "rate_hz",
                .cite = cite,
                .points = {}};
    const auto rates = series(values, field, curvature.size(), "curvature_per_m");
    for (std::size_t i = 0; i < rates.size(); ++i) {
      stimulus.indenter.radius_mm = radius_of_curvature_mm(curvature[i]);
      set.points.push_back({.x = curvature[i], .measured = rates[i], .stimulus = stimulus});
    }
    recordings.sets.push_back(std::move(set));
  }
  fields.finish();
}

void read_lateral_offset(JsonFields fields, const std::string& cite, Recordings& recordings) {
  const std::vector<double> offset = fields.numbers("offset_mm", true);
  const double curvature =
      JsonFields::number_of(fields.need("curvature_per_m"), fields.full("curvature_per_m"));
  Stimulus base;
  base.indenter.radius_mm = radius_of_curvature_mm(curvature);
  read_timing(fields, base);
  if (const std::string direction = fields.text("direction"); !direction.empty()) {
    if (direction != "along" && direction != "across") {
      refuse_field(fields.full("direction"), "must be \"along\" the finger or \"across\" it");
    }
    base.offset_across = direction == "across";
  }
  for (const auto& [key, values] : series_of(fields, "rate_hz").items()) {
    const std::string field = fields.full("rate_hz." + key);
    Stimulus stimulus = base;
    set_level(stimulus, key, field);
    DataSet set{
        .name = "lateral offset, " + shortest_decimal(curvature) + " /m, " + level_name(stimulus),
        .section = "lateral_offset",
        .x_name = "offset_mm",
        .y_name = "rate_hz",
        .cite = cite,
        .points = {}};
    const auto rates = series(values, field, offset.size(), "offset_mm");
    for (std::size_t i = 0; i < rates.size(); ++i) {
      stimulus.offset_mm = offset[i];
      set.points.push_back({.x = offset[i], .measured = rates[i], .stimulus = stimulus});
    }
    recordings.sets.push_back(std::move(set));
  }
  fields.finish();
}

/// Bars by their widths and gaps, positions then counting from the middle of the row; or by the
/// places of their edges along x, with positions on the same axis. Returns the middle's place.
double read_bars(JsonFields& fields, Indenter& indenter) {
  indenter.tip = Indenter::Tip::kBars;
  BarTip& bars = indenter.bars;
  bars.gaps_mm.clear();
  double middle_mm = 0.0;
  std::string given = "bar_widths_mm";
  if (const Json* const edges = fields.find("bar_edges_mm"); edges != nullptr) {
    given = "bar_edges_mm";
    const std::string field = fields.full(given);
    if (fields.find("bar_widths_mm") != nullptr || fields.find("bar_gaps_mm") != nullptr) {
      refuse_field(field, "says where the bars are: leave out bar_widths_mm and bar_gaps_mm");
    }
    if (!edges->is_array() || edges->empty()) {
      refuse_field(field, "must be a list of [left, right], one a bar, in order");
    }
    bars.widths_mm.clear();
    double first = 0.0;
    double last = 0.0;
    for (const Json& pair : *edges) {
      const auto edge = JsonFields::numbers_of(pair, field, true);
      if (edge.size() != 2 || !(edge[0] < edge[1]) ||
          (!bars.widths_mm.empty() && edge[0] <= last)) {
        refuse_field(field, "must be a list of [left, right], one a bar, in order and apart");
      }
      if (bars.widths_mm.empty()) {
        first = edge[0];
      } else {
        bars.gaps_mm.push_back(edge[0] - last);
      }
      bars.widths_mm.push_back(edge[1] - edge[0]);
      last = edge[1];
    }
    middle_mm = 0.5 * (first + last);
  } else {
    bars.widths_mm = fields.numbers("bar_widths_mm");
    if (const Json* const gaps = fields.find("bar_gaps_mm"); gaps != nullptr && !gaps->empty()) {
      bars.gaps_mm = JsonFields::numbers_of(*gaps, fields.full("bar_gaps_mm"));
    }
  }
  bars.length_mm = fields.number("bar_length_mm", 20.0);
  if (const auto checked = bars.check(); !checked) {
    const std::string key = checked.error().key.substr(checked.error().key.find('.') + 1);
    refuse_field(fields.full(key == "bar_length_mm" || given == "bar_widths_mm" ? key : given),
                 checked.error().reason);
  }
  return middle_mm;
}

void read_bar_profile(JsonFields fields, const std::string& cite, Recordings& recordings) {
  const std::vector<double> position = fields.numbers("position_mm", true);
  Stimulus base;
  const double middle_mm = read_bars(fields, base.indenter);
  read_timing(fields, base);
  for (const auto& [key, values] : series_of(fields, "rate_hz").items()) {
    const std::string field = fields.full("rate_hz." + key);
    Stimulus stimulus = base;
    set_level(stimulus, key, field);
    DataSet set{.name = "bar profile, " + level_name(stimulus),
                .section = "bar_profile",
                .x_name = "position_mm",
                .y_name = "rate_hz",
                .cite = cite,
                .points = {}};
    const auto rates = series(values, field, position.size(), "position_mm");
    for (std::size_t i = 0; i < rates.size(); ++i) {
      // The afferent at a position under the bars sees them shifted the other way.
      stimulus.offset_mm = middle_mm - position[i];
      set.points.push_back({.x = position[i], .measured = rates[i], .stimulus = stimulus});
    }
    recordings.sets.push_back(std::move(set));
  }
  fields.finish();
}

void read_vibration(JsonFields fields, const std::string& cite, Recordings& recordings) {
  Stimulus base;
  base.indenter.tip = Indenter::Tip::kPin;
  base.indenter.pin.diameter_mm = fields.number("probe_diameter_mm", 1.0);
  base.level = fields.number("pre_indentation_mm", 0.0, true);
  read_timing(fields, base);
  base.settle_s = base.level > 0.0 ? base.ramp_s + fields.number("settle_s", 0.3, true)
                                   : fields.number("settle_s", 0.0, true);
  bool any = false;
  for (const auto& [key, values] : fields.object().items()) {
    if (!ends_in(key, "Hz")) continue;
    any = true;
    fields.find(key);
    const std::string field = fields.full(key);
    Stimulus stimulus = base;
    stimulus.frequency_hz = quantity(key, "Hz", field, "20Hz");
    JsonFields own(values, field);
    const std::vector<double> amplitude = own.numbers("um");
    const auto rates = series(own.need("hz"), field + ".hz", amplitude.size(), "um");
    own.finish();
    DataSet set{.name = "vibration, " + shortest_decimal(stimulus.frequency_hz) + " Hz",
                .section = "vibration",
                .x_name = "amplitude_um",
                .y_name = "rate_hz",
                .cite = cite,
                .points = {}};
    for (std::size_t i = 0; i < rates.size(); ++i) {
      stimulus.amplitude_mm = units::mm_from_um(amplitude[i]);
      set.points.push_back({.x = amplitude[i], .measured = rates[i], .stimulus = stimulus});
    }
    recordings.sets.push_back(std::move(set));
  }
  fields.finish();
  if (!any) refuse_field(fields.full(""), "needs a series named by its frequency, as in \"20Hz\"");
}

void read_hold_adaptation(JsonFields fields, const std::string& cite, Recordings& recordings) {
  Stimulus base;
  base.indenter.tip = Indenter::Tip::kPin;
  base.indenter.pin.diameter_mm = fields.number("probe_diameter_mm", 1.0);
  base.count_s = fields.number("count_s", 1.0);
  const double speed_mm_per_s = fields.number("ramp_mm_per_s", 0.4);
  const std::string prefix = "decline_over_first_";
  bool any = false;
  for (const auto& [key, values] : fields.object().items()) {
    if (key.compare(0, prefix.size(), prefix) != 0) continue;
    any = true;
    fields.find(key);
    const std::string field = fields.full(key);
    const double over_s = quantity(key, "s", field, "decline_over_first_12s");
    if (over_s < base.count_s) refuse_field(field, "must be at least count_s long");
    if (!values.is_object() || values.empty()) {
      refuse_field(field,
                   "must be an object with a decline for each depth, as in \"0.65mm\": 0.38");
    }
    DataSet set{.name = "fall of rate over " + shortest_decimal(over_s) + " s of hold",
                .section = "hold_adaptation",
                .x_name = "depth_mm",
                .y_name = "decline",
                .cite = cite,
                .points = {}};
    for (const auto& [depth, decline] : values.items()) {
      Stimulus stimulus = base;
      stimulus.level = quantity(depth, "mm", field + "." + depth, "0.65mm");
      stimulus.ramp_s = stimulus.level / speed_mm_per_s;
      stimulus.decline_over_s = over_s;
      const double fraction = JsonFields::number_of(decline, field + "." + depth, true, true);
      if (!(fraction > -1.0 && fraction <= 1.0)) {
        refuse_field(field + "." + depth, "must be a fraction of the rate, from -1 to 1");
      }
      set.points.push_back({.x = stimulus.level, .measured = fraction, .stimulus = stimulus});
    }
    recordings.sets.push_back(std::move(set));
  }
  fields.finish();
  if (!any) refuse_field(fields.full(prefix + "12s"), "is missing");
}

void read_field_area(JsonFields fields, Recordings& recordings) {
  const std::vector<double> depth_um = fields.numbers("depth_um");
  const auto area =
      series(fields.need("SA1_mm2"), fields.full("SA1_mm2"), depth_um.size(), "depth_um");
  const double background_mm = fields.number("background_depth_mm", 0.0, true);
  for (std::size_t i = 0; i < area.size(); ++i) {
    recordings.field_areas.push_back({.depth_mm = units::mm_from_um(depth_um[i]),
                                      .area_mm2 = area[i],
                                      .background_mm = background_mm});
  }
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

void read_tip(JsonFields& fields, Indenter& indenter) {
  const std::string tip = fields.text("tip");
  if (tip.empty() || tip == "sphere") {
    if (const Json* const radius = fields.find("radius_mm"); radius != nullptr) {
      indenter.radius_mm = radius->is_string() && radius->get<std::string>() == "inf"
                               ? std::numeric_limits<double>::infinity()
                               : JsonFields::number_of(*radius, fields.full("radius_mm"), false);
    }
  } else if (tip == "pin") {
    indenter.tip = Indenter::Tip::kPin;
    indenter.pin.diameter_mm = fields.number("probe_diameter_mm", 1.0);
  } else if (tip == "bars") {
    static_cast<void>(read_bars(fields, indenter));
  } else {
    refuse_field(fields.full("tip"), "must be \"sphere\", \"pin\" or \"bars\"");
  }
}

void read_trials(JsonFields fields, const std::string& cite, Recordings& recordings) {
  RecordedTrials trials;
  trials.cite = cite;
  trials.trace_file = fields.text("trace");
  if (trials.trace_file.empty()) {
    refuse_field(fields.full("trace"), "is missing: name the recorded press (CSV)");
  }
  trials.name = "trials: " + trials.trace_file;
  if (const std::string name = fields.text("name"); !name.empty()) trials.name = name;
  if (trials.name.find_first_of("\"\n") != std::string::npos) {
    refuse_field(fields.full("name"), "must not hold quotes or line ends");
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

/// Calls `read` for the section's object, or for each of a list of objects.
template <class Read>
void for_each_object(JsonFields& root, const std::string& section, Read read) {
  const Json* const found = root.find(section);
  if (found == nullptr) return;
  const auto one = [&](const Json& object, const std::string& name) {
    JsonFields fields(object, name);
    const std::string cite = fields.text("cite");
    if (cite.empty()) refuse_field(fields.full("cite"), "is missing: say where the data are from");
    read(std::move(fields), cite);
  };
  if (!found->is_array()) {
    one(*found, section);
    return;
  }
  for (std::size_t i = 0; i < found->size(); ++i) {
    one((*found)[i], section + "[" + std::to_string(i) + "]");
  }
}

Recordings recordings_of(const Json& json) {
  Recordings recordings;
  JsonFields root(json, "");
  static_cast<void>(root.text("note"));
  const auto with_sets = [&](const std::string& section, auto read) {
    for_each_object(root, section, [&](JsonFields fields, const std::string& cite) {
      read(std::move(fields), cite, recordings);
    });
  };
  with_sets("curvature_force", read_curvature_force);
  with_sets("lateral_offset", read_lateral_offset);
  with_sets("bar_profile", read_bar_profile);
  with_sets("vibration", read_vibration);
  with_sets("hold_adaptation", read_hold_adaptation);
  with_sets("trials", read_trials);
  const auto others = [&](const std::string& section, auto read) {
    for_each_object(root, section, [&](JsonFields fields, const std::string& /*cite*/) {
      read(std::move(fields), recordings);
    });
  };
  others("receptive_field_area", read_field_area);
  others("adaptation_kinetics", read_kinetics);
  others("isi", read_intervals);
  root.finish();
  if (recordings.sets.empty() && recordings.trials.empty() && recordings.field_areas.empty() &&
      recordings.intervals.empty()) {
    throw JsonFault{"holds no data: give it a section such as curvature_force"};
  }
  return recordings;
}

}  // namespace

Expected<Recordings, SetupError> parse_recordings(const std::string& text,
                                                  const std::string& name) {
  try {
    return recordings_of(Json::parse(text));
  } catch (const Json::parse_error& error) {
    const auto until =
        text.begin() + static_cast<std::ptrdiff_t>(std::min(error.byte, text.size()));
    return bad_input(name + ":" + std::to_string(1 + std::count(text.begin(), until, '\n')) +
                     ": this is not JSON");
  } catch (const Json::out_of_range&) {
    return bad_input(name + ": holds a number that is too large for any program");
  } catch (const JsonFault& fault) {
    return bad_input(name + ": " + fault.sentence);
  }
}

Expected<Recordings, SetupError> read_recordings(const std::string& path) {
  constexpr std::size_t kLargest = std::size_t{1} << 20U;
  std::ifstream file(path, std::ios::binary);
  if (!file) return bad_input("cannot read the data file " + path + ": " + std::strerror(errno));
  std::string text(kLargest + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (file.bad()) return bad_input("cannot read the data file " + path + ": is it a file?");
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (text.size() > kLargest) return bad_input(path + " is larger than any data file (1 MiB)");
  auto recordings = parse_recordings(text, path);
  if (!recordings) return recordings;
  const std::size_t slash = path.rfind('/');
  const std::string folder = slash == std::string::npos ? "" : path.substr(0, slash);
  if (auto loaded = load_trials(*recordings, folder); !loaded) {
    return Unexpected<SetupError>(loaded.error());
  }
  return recordings;
}

Recordings published_recordings() {
  return parse_recordings(kPublishedRecordings, "physiology.json").value();
}

Expected<Recordings, SetupError> recordings_named(const std::string& path) {
  return path.empty() ? published_recordings() : read_recordings(path);
}

}  // namespace merkel
