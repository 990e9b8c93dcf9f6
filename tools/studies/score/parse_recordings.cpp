#include <algorithm>
#include <utility>

#include "core/parameters/parameter_error.hpp"
#include "tools/studies/score/json_fields.hpp"
#include "tools/studies/score/recording_sections.hpp"
#include "tools/studies/score/recordings.hpp"

namespace merkel {
namespace {

/// Calls `read` for the section's object, or for each of a list of objects.
template <class Read>
void for_each_object(JsonFields& root, const std::string& section, Read read) {
  const Json* const found = root.find(section);
  if (found == nullptr) return;
  const auto one = [&](const Json& object, const std::string& name) {
    JsonFields fields(object, name);
    const std::string cite = fields.text("cite");
    if (cite.empty()) refuse_field(fields.full("cite"), "is missing: give the source of the data");
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
      const bool fit = fields.truth("fit", true);
      const std::size_t sets = recordings.sets.size();
      const std::size_t trials = recordings.trials.size();
      read(std::move(fields), cite, recordings);
      for (std::size_t i = sets; i < recordings.sets.size(); ++i) recordings.sets[i].fit = fit;
      for (std::size_t i = trials; i < recordings.trials.size(); ++i)
        recordings.trials[i].fit = fit;
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
  others("surround_suppression", read_surround);
  others("adaptation_kinetics", read_kinetics);
  others("isi", read_intervals);
  root.finish();
  if (recordings.sets.empty() && recordings.trials.empty() && recordings.field_areas.empty() &&
      recordings.surrounds.empty() && recordings.intervals.empty()) {
    throw JsonFault{"holds no data: add a section such as curvature_force"};
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
                     ": this is not valid JSON");
  } catch (const Json::out_of_range&) {
    return bad_input(name + ": holds a number that is too large");
  } catch (const JsonFault& fault) {
    return bad_input(name + ": " + fault.sentence);
  }
}

}  // namespace merkel
