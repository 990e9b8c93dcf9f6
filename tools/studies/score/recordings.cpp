#include "tools/studies/score/recordings.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <utility>

#include <nlohmann/json.hpp>

#include "core/parameters/nearest_name.hpp"
#include "core/parameters/parameter_error.hpp"
#include "core/units.hpp"

namespace merkel {

/// The text of tools/studies/score/physiology.json, built into the program.
extern const char* const kPublishedRecordings;

namespace {

using Json = nlohmann::ordered_json;

/// One sentence about a field; caught at the file's border.
struct Fault {
  std::string sentence;
};

[[noreturn]] void refuse_field(const std::string& field, const std::string& reason) {
  throw Fault{field + " " + reason};
}

/// The fields of one JSON object. Each that is asked for is known; finish() names one that is not.
class Fields {
 public:
  Fields(const Json& object, std::string name) : object_(object), name_(std::move(name)) {
    if (!object.is_object()) refuse_field(name_, "must be an object with named fields");
  }

  [[nodiscard]] std::string full(const std::string& key) const {
    return name_.empty() ? key : name_ + "." + key;
  }
  const Json* find(const std::string& key) {
    known_.push_back(key);
    const auto found = object_.find(key);
    return found == object_.end() ? nullptr : &*found;
  }
  const Json& need(const std::string& key) {
    const Json* const found = find(key);
    if (found == nullptr) refuse_field(full(key), "is missing");
    return *found;
  }
  std::string text(const std::string& key) {
    const Json* const found = find(key);
    if (found == nullptr) return "";
    if (!found->is_string()) refuse_field(full(key), "must be a text in quotes");
    return found->get<std::string>();
  }
  double number(const std::string& key, double otherwise, bool may_be_zero = false) {
    const Json* const found = find(key);
    return found == nullptr ? otherwise : number_of(*found, full(key), may_be_zero);
  }
  std::vector<double> numbers(const std::string& key, bool may_be_negative = false) {
    return numbers_of(need(key), full(key), may_be_negative);
  }
  static double number_of(const Json& value, const std::string& field, bool may_be_zero = true,
                          bool may_be_negative = false) {
    if (!value.is_number()) refuse_field(field, "must be a number");
    const double number = value.get<double>();
    if (!std::isfinite(number)) refuse_field(field, "must be a finite number");
    if (may_be_negative || number > 0.0 || (may_be_zero && number == 0.0)) return number;
    refuse_field(field, "must be " + std::string(may_be_zero ? "zero or positive" : "positive") +
                            ", but is " + shortest_decimal(number));
  }
  static std::vector<double> numbers_of(const Json& value, const std::string& field,
                                        bool may_be_negative = false) {
    if (!value.is_array() || value.empty()) refuse_field(field, "must be a list of numbers");
    std::vector<double> numbers;
    for (const Json& item : value) {
      numbers.push_back(number_of(item, field, true, may_be_negative));
    }
    return numbers;
  }
  void finish() {
    for (const auto& [key, value] : object_.items()) {
      if (std::find(known_.begin(), known_.end(), key) != known_.end()) continue;
      double bare = 0.0;
      const auto [end, error] = std::from_chars(key.data(), key.data() + key.size(), bare);
      if (error == std::errc() && end == key.data() + key.size()) {
        refuse_field(full(key), "has no unit: name it with one, as in \"20Hz\" or \"0.65mm\"");
      }
      const std::string nearest = nearest_name(key, known_);
      std::string list;
      for (const std::string& known : known_) list.append(list.empty() ? "" : ", ").append(known);
      refuse_field("the field " + full(key),
                   "is not known" + (nearest.empty() ? "; known are " + list
                                                     : ": did you mean " + nearest + "?"));
    }
  }
  [[nodiscard]] const Json& object() const { return object_; }

 private:
  const Json& object_;
  std::string name_;
  std::vector<std::string> known_;
};

/// The number before a unit at the end of a key, as 0.098 in "10gwt_0.098N"; positive.
double quantity(const std::string& key, const std::string& unit, const std::string& field,
                const std::string& example) {
  const std::size_t begin = key.rfind('_') == std::string::npos ? 0 : key.rfind('_') + 1;
  double value = 0.0;
  const char* const first = key.data() + begin;
  const char* const last = key.data() + key.size();
  const auto [end, error] = std::from_chars(first, last, value);
  if (error != std::errc() || std::string(end, last) != unit) {
    refuse_field(field, "must end in a number with its unit, as in \"" + example + "\"");
  }
  if (!(std::isfinite(value) && value > 0.0)) {
    refuse_field(field, "must have a positive number before " + unit);
  }
  return value;
}

bool ends_in(const std::string& key, const std::string& unit) {
  return key.size() > unit.size() && key.compare(key.size() - unit.size(), unit.size(), unit) == 0;
}

/// What all sections may say of how the tip was pressed.
void read_timing(Fields& fields, Stimulus& stimulus) {
  stimulus.ramp_s = 1e-3 * fields.number("ramp_ms", 1e3 * stimulus.ramp_s);
  stimulus.count_s = fields.number("count_s", stimulus.count_s);
}

/// A number for each x; for the name of a series ("10gwt_0.098N").
std::vector<double> series(const Json& values, const std::string& field, std::size_t count,
                           const std::string& x_name) {
  std::vector<double> numbers = Fields::numbers_of(values, field);
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

const Json& series_of(Fields& fields, const std::string& key) {
  const Json& rates = fields.need(key);
  if (!rates.is_object() || rates.empty()) {
    refuse_field(fields.full(key), "must be an object with a list of numbers for each series");
  }
  return rates;
}

void read_curvature_force(Fields fields, const std::string& cite, Recordings& recordings) {
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

void read_lateral_offset(Fields fields, const std::string& cite, Recordings& recordings) {
  const std::vector<double> offset = fields.numbers("offset_mm", true);
  const double curvature =
      Fields::number_of(fields.need("curvature_per_m"), fields.full("curvature_per_m"));
  Stimulus base;
  base.indenter.radius_mm = radius_of_curvature_mm(curvature);
  read_timing(fields, base);
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

void read_bar_profile(Fields fields, const std::string& cite, Recordings& recordings) {
  const std::vector<double> position = fields.numbers("position_mm", true);
  Stimulus base;
  base.indenter.tip = Indenter::Tip::kBars;
  base.indenter.bars.widths_mm = fields.numbers("bar_widths_mm");
  base.indenter.bars.gaps_mm.clear();
  if (const Json* const gaps = fields.find("bar_gaps_mm"); gaps != nullptr && !gaps->empty()) {
    base.indenter.bars.gaps_mm = Fields::numbers_of(*gaps, fields.full("bar_gaps_mm"));
  }
  base.indenter.bars.length_mm = fields.number("bar_length_mm", 20.0);
  if (const auto checked = base.indenter.bars.check(); !checked) {
    const std::string key = checked.error().key.substr(checked.error().key.find('.') + 1);
    refuse_field(fields.full(key), checked.error().reason);
  }
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
      stimulus.offset_mm = -position[i];
      set.points.push_back({.x = position[i], .measured = rates[i], .stimulus = stimulus});
    }
    recordings.sets.push_back(std::move(set));
  }
  fields.finish();
}

void read_vibration(Fields fields, const std::string& cite, Recordings& recordings) {
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
    Fields own(values, field);
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

void read_hold_adaptation(Fields fields, const std::string& cite, Recordings& recordings) {
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
      const double fraction = Fields::number_of(decline, field + "." + depth, true, true);
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

void read_field_area(Fields fields, Recordings& recordings) {
  const std::vector<double> depth_um = fields.numbers("depth_um");
  const auto area =
      series(fields.need("SA1_mm2"), fields.full("SA1_mm2"), depth_um.size(), "depth_um");
  for (std::size_t i = 0; i < area.size(); ++i) {
    recordings.field_areas.push_back(
        {.depth_mm = units::mm_from_um(depth_um[i]), .area_mm2 = area[i]});
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

void read_kinetics(Fields fields, Recordings& recordings) {
  const Json& taus = fields.need("tau_ms");
  if (!taus.is_array()) refuse_field(fields.full("tau_ms"), "must be a list");
  for (const Json& tau : taus) {
    if (tau.is_string() && tau.get<std::string>() == "inf") continue;
    recordings.time_constants_ms.push_back(Fields::number_of(tau, fields.full("tau_ms"), false));
  }
  fields.finish();
}

void read_intervals(Fields fields, Recordings& recordings) {
  const std::vector<double> depth = fields.numbers("depth_mm");
  const auto mean =
      series(fields.need("mean_isi_ms"), fields.full("mean_isi_ms"), depth.size(), "depth_mm");
  const auto sd = series(fields.need("sd_ms"), fields.full("sd_ms"), depth.size(), "depth_mm");
  for (std::size_t i = 0; i < mean.size(); ++i) {
    recordings.intervals.push_back({.mean_ms = mean[i], .sd_ms = sd[i]});
  }
  fields.finish();
}

/// Calls `read` for the section's object, or for each of a list of objects.
template <class Read>
void for_each_object(Fields& root, const std::string& section, Read read) {
  const Json* const found = root.find(section);
  if (found == nullptr) return;
  const auto one = [&](const Json& object, const std::string& name) {
    Fields fields(object, name);
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
  Fields root(json, "");
  static_cast<void>(root.text("note"));
  const auto with_sets = [&](const std::string& section, auto read) {
    for_each_object(root, section, [&](Fields fields, const std::string& cite) {
      read(std::move(fields), cite, recordings);
    });
  };
  with_sets("curvature_force", read_curvature_force);
  with_sets("lateral_offset", read_lateral_offset);
  with_sets("bar_profile", read_bar_profile);
  with_sets("vibration", read_vibration);
  with_sets("hold_adaptation", read_hold_adaptation);
  const auto others = [&](const std::string& section, auto read) {
    for_each_object(root, section, [&](Fields fields, const std::string& /*cite*/) {
      read(std::move(fields), recordings);
    });
  };
  others("receptive_field_area", read_field_area);
  others("adaptation_kinetics", read_kinetics);
  others("isi", read_intervals);
  root.finish();
  if (recordings.sets.empty() && recordings.field_areas.empty() && recordings.intervals.empty()) {
    throw Fault{"holds no data: give it a section such as curvature_force"};
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
  } catch (const Fault& fault) {
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
  return parse_recordings(text, path);
}

Recordings published_recordings() {
  return parse_recordings(kPublishedRecordings, "physiology.json").value();
}

Expected<Recordings, SetupError> recordings_named(const std::string& path) {
  return path.empty() ? published_recordings() : read_recordings(path);
}

}  // namespace merkel
