// Sections with rates or declines, compared with the model point by point.
#include <functional>
#include <limits>
#include <utility>

#include "core/parameters/parameter_error.hpp"
#include "core/units.hpp"
#include "tools/studies/score/recording_sections.hpp"

namespace merkel {
namespace {

/// Reads the timing of the press, common to all sections.
void read_timing(JsonFields& fields, Stimulus& stimulus) {
  stimulus.ramp_s = 1e-3 * fields.number("ramp_ms", 1e3 * stimulus.ramp_s);
  stimulus.count_s = fields.number("count_s", stimulus.count_s);
}

/// Sets the level of a hold, in N or mm, from the name of a series.
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

const Json& series_of(JsonFields& fields, const char* key) {
  const Json& rates = fields.need(key);
  if (!rates.is_object() || rates.empty()) {
    refuse_field(fields.full(key), "must be an object with a list of numbers for each series");
  }
  return rates;
}

}  // namespace

/// Reads one number per x of a series, for example "10gwt_0.098N".
std::vector<double> series(const Json& values, const std::string& field, std::size_t count,
                           const std::string& x_name) {
  std::vector<double> numbers = JsonFields::numbers_of(values, field);
  if (numbers.size() != count) {
    refuse_field(field, "must have as many numbers as " + x_name + ": " + std::to_string(count) +
                            ", but has " + std::to_string(numbers.size()));
  }
  return numbers;
}

namespace {

/// A point for each x, with its rate. \param put  sets x in a stimulus
void add_points(DataSet& set, Stimulus stimulus, const std::vector<double>& x,
                const std::vector<double>& rates,
                const std::function<void(Stimulus&, double)>& put) {
  for (std::size_t i = 0; i < rates.size(); ++i) {
    put(stimulus, x[i]);
    set.points.push_back({.x = x[i], .measured = rates[i], .stimulus = stimulus});
  }
}

/// A data set for each level of a hold, with a point for each x.
/// \param set  its name gets the level
void read_levels(JsonFields& fields, const Stimulus& base, const DataSet& set,
                 const std::vector<double>& x, const std::function<void(Stimulus&, double)>& put,
                 Recordings& recordings) {
  for (const auto& [key, values] : series_of(fields, "rate_hz").items()) {
    const std::string field = fields.full("rate_hz." + key);
    Stimulus stimulus = base;
    set_level(stimulus, key, field);
    DataSet& own = recordings.sets.emplace_back(set);
    own.name += ", " + level_name(stimulus);
    add_points(own, stimulus, x, series(values, field, x.size(), set.x_name), put);
  }
  fields.finish();
}

}  // namespace

void read_curvature_force(JsonFields fields, const std::string& cite, Recordings& recordings) {
  const std::vector<double> curvature = fields.numbers("curvature_per_m");
  Stimulus base;
  read_timing(fields, base);
  read_levels(
      fields, base,
      {.name = "curvature × force",
       .section = "curvature_force",
       .x_name = "curvature_per_m",
       .y_name = "rate_hz",
       .cite = cite},
      curvature,
      [](Stimulus& stimulus, double per_m) {
        stimulus.indenter.tip = SphereTip{radius_of_curvature_mm(per_m)};
      },
      recordings);
}

void read_lateral_offset(JsonFields fields, const std::string& cite, Recordings& recordings) {
  const std::vector<double> offset = fields.numbers("offset_mm", true);
  const double curvature =
      JsonFields::number_of(fields.need("curvature_per_m"), fields.full("curvature_per_m"));
  Stimulus base;
  base.indenter.tip = SphereTip{radius_of_curvature_mm(curvature)};
  read_timing(fields, base);
  if (const std::string direction = fields.text("direction"); !direction.empty()) {
    if (direction != "along" && direction != "across") {
      refuse_field(fields.full("direction"), "must be \"along\" the finger or \"across\" it");
    }
    base.offset_across = direction == "across";
  }
  read_levels(
      fields, base,
      {.name = "lateral offset, " + shortest_decimal(curvature) + " /m",
       .section = "lateral_offset",
       .x_name = "offset_mm",
       .y_name = "rate_hz",
       .cite = cite},
      offset, [](Stimulus& stimulus, double mm) { stimulus.offset_mm = mm; }, recordings);
}

double read_bars(JsonFields& fields, Indenter& indenter) {
  BarTip& bars = indenter.tip.emplace<BarTip>();
  bars.gaps_mm.clear();
  double middle_mm = 0.0;
  std::string given = "bar_widths_mm";
  if (const Json* const edges = fields.find("bar_edges_mm"); edges != nullptr) {
    given = "bar_edges_mm";
    const std::string field = fields.full(given);
    if (fields.find("bar_widths_mm") != nullptr || fields.find("bar_gaps_mm") != nullptr) {
      refuse_field(field, "already gives the bars: remove bar_widths_mm and bar_gaps_mm");
    }
    if (!edges->is_array() || edges->empty()) {
      refuse_field(field, "must be a list of [left, right], one per bar, in order");
    }
    bars.widths_mm.clear();
    double first = 0.0;
    double last = 0.0;
    for (const Json& pair : *edges) {
      const auto edge = JsonFields::numbers_of(pair, field, true);
      if (edge.size() != 2 || !(edge[0] < edge[1]) ||
          (!bars.widths_mm.empty() && edge[0] <= last)) {
        refuse_field(field, "must be a list of [left, right], one per bar, in order and separate");
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
  ParameterCheck all;
  bars.check({}, all);
  if (const auto checked = all.fields(bars).result(); !checked) {
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
  // For an afferent at a position under the bars, the bars are shifted the opposite way.
  read_levels(
      fields, base,
      {.name = "bar profile",
       .section = "bar_profile",
       .x_name = "position_mm",
       .y_name = "rate_hz",
       .cite = cite},
      position, [&](Stimulus& stimulus, double mm) { stimulus.offset_mm = middle_mm - mm; },
      recordings);
}

void read_vibration(JsonFields fields, const std::string& cite, Recordings& recordings) {
  Stimulus base;
  base.indenter.tip = PinTip{.diameter_mm = fields.number("probe_diameter_mm", 1.0)};
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
                .cite = cite};
    add_points(set, stimulus, amplitude, rates,
               [](Stimulus& each, double um) { each.amplitude_mm = units::mm_from_um(um); });
    recordings.sets.push_back(std::move(set));
  }
  fields.finish();
  if (!any) refuse_field(fields.full(""), "needs a series named by its frequency, as in \"20Hz\"");
}

void read_hold_adaptation(JsonFields fields, const std::string& cite, Recordings& recordings) {
  Stimulus base;
  if (fields.find("curvature_per_m") != nullptr) {
    base.indenter.tip =
        SphereTip{radius_of_curvature_mm(fields.number("curvature_per_m", 0.0, true))};
  } else {
    base.indenter.tip = PinTip{.diameter_mm = fields.number("probe_diameter_mm", 1.0)};
  }
  base.count_s = fields.number("count_s", 1.0);
  base.decline_from_s = fields.number("from_s", 0.0, true);
  const double speed_mm_per_s = fields.number("ramp_mm_per_s", 0.4);
  const double ramp_s = 1e-3 * fields.number("ramp_ms", 50.0);
  const std::string prefix = "decline_over_first_";
  bool any = false;
  for (const auto& [key, values] : fields.object().items()) {
    if (key.compare(0, prefix.size(), prefix) != 0) continue;
    any = true;
    fields.find(key);
    const std::string field = fields.full(key);
    const double over_s = quantity(key, "s", field, "decline_over_first_12s");
    if (over_s < base.decline_from_s + base.count_s) {
      refuse_field(field, "must be at least from_s and count_s long");
    }
    if (!values.is_object() || values.empty()) {
      refuse_field(field,
                   "must be an object with a decline for each level, as in \"0.65mm\": 0.38");
    }
    const std::string from = base.decline_from_s > 0.0
                                 ? "from " + shortest_decimal(base.decline_from_s) + " to "
                                 : "over ";
    DataSet set{.name = "fall of rate " + from + shortest_decimal(over_s) + " s of hold",
                .section = "hold_adaptation",
                .x_name = "depth_mm",
                .y_name = "decline",
                .cite = cite};
    for (const auto& [depth, decline] : values.items()) {
      Stimulus stimulus = base;
      set_level(stimulus, depth, field + "." + depth);
      const bool by_force = stimulus.indenter.control == Indenter::Control::kForce;
      stimulus.ramp_s = by_force ? ramp_s : stimulus.level / speed_mm_per_s;
      stimulus.decline_over_s = over_s;
      const double fraction = JsonFields::number_of(decline, field + "." + depth, true, true);
      if (!(fraction > -1.0 && fraction <= 1.0)) {
        refuse_field(field + "." + depth, "must be a fraction of the rate, from -1 to 1");
      }
      set.x_name = by_force ? "force_N" : "depth_mm";
      set.points.push_back({.x = by_force ? units::N_from_mN(stimulus.level) : stimulus.level,
                            .measured = fraction,
                            .stimulus = stimulus});
    }
    recordings.sets.push_back(std::move(set));
  }
  fields.finish();
  if (!any) refuse_field(fields.full(prefix + "12s"), "is missing");
}

}  // namespace merkel
